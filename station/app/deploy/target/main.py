"""The command on the target: `deploy.pyz install|rollback|uninstall|status`; its answer is one line of JSON."""

from __future__ import annotations

import argparse
import contextlib
import fcntl
import json
import os
import sys
from collections.abc import Generator
from pathlib import Path
from typing import Any

from .install import Wanted, install, roll_back, status, uninstall
from .paths import Refused


def main(words: list[str]) -> int:
    """Gives the exit status; a refusal is one JSON line as well, and status 1."""
    parser = argparse.ArgumentParser(prog="deploy.pyz", description=__doc__)
    parser.add_argument("action", choices=("install", "rollback", "uninstall", "status"))
    parser.add_argument("--wanted", default="", help="the release to install, as JSON")
    parser.add_argument("--root", default="/", help="install below this folder")
    parser.add_argument("--supervisor", choices=("systemd", "none"), default="systemd")
    parser.add_argument("--purge", action="store_true", help="uninstall the calibrations too")
    options = parser.parse_args(words)
    os.umask(0o022)
    try:
        with _alone(options.root):
            answer = _act(options)
    except Refused as error:
        print(json.dumps({"refused": str(error)}))
        return 1
    except PermissionError as error:
        print(json.dumps({"refused": f"No permission for {error.filename}: log in as one who may use sudo"}))
        return 1
    print(json.dumps(answer))
    return 0


def _act(options: argparse.Namespace) -> dict[str, Any]:
    if options.action == "install":
        return install(Wanted(**json.loads(options.wanted)))
    if options.action == "rollback":
        return roll_back(options.root, options.supervisor)
    if options.action == "uninstall":
        return uninstall(options.root, purge=options.purge)
    return status(options.root, options.supervisor)


@contextlib.contextmanager
def _alone(root: str) -> Generator[None]:
    """Refuses a second deployment at once, which would mix the releases; the lock is on the folder itself."""
    Path(root).mkdir(parents=True, exist_ok=True)
    folder = os.open(root, os.O_RDONLY)
    try:
        fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    except BlockingIOError as error:
        raise Refused("Another deployment to this target is under way: wait until it has ended") from error
    finally:
        os.close(folder)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
