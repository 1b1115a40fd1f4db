"""Installs a release and switches to it, or leaves everything as it was."""

from __future__ import annotations

import compileall
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from . import clock
from .account import ensure_account, give_to_root, remove_account
from .paths import SERVICE, Refused, TargetPaths, point
from .smoke import try_release
from .supervisors import Supervisor, stays_up, supervisor_of

KEPT = 3
"""Releases that stay on the target: the one that runs, the one before, and one more."""


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """The laptop's wishes; `station` empty: leave the clock alone."""

    root: str
    release: str
    venv: str
    python: str
    supervisor: str
    station: str = ""
    own_numpy: bool = False
    settle_s: float = 3.0


def install(wanted: Wanted) -> dict[str, Any]:
    """Installs what lies in `incoming` (or is there already), tries it, switches to it, and watches it start.

    Raises:
        Refused: if it failed; the release that ran before then runs again.
    """
    paths = TargetPaths(Path(wanted.root))
    account = ensure_account(wanted=wanted.root == "/")
    _state_folder(paths, account)
    release = paths.releases / wanted.release
    supervisor = supervisor_of(wanted.supervisor, paths, account=account)
    try:
        _place_venv(paths, wanted)
        _place_release(paths, wanted, account)
        if not (paths.release_of(paths.current) == wanted.release and supervisor.running()):
            try_release(release, own_numpy=wanted.own_numpy, account=account)
    except (Refused, OSError) as error:
        if paths.release_of(paths.current) != wanted.release:
            shutil.rmtree(release, ignore_errors=True)
        raise error if isinstance(error, Refused) else Refused(f"The target refused a file: {error}") from error
    finally:
        shutil.rmtree(paths.incoming, ignore_errors=True)
    if wanted.station:
        clock.follow(paths, wanted.station)
    switched = paths.release_of(paths.current) != wanted.release
    changed = _switch(paths, wanted, supervisor)
    _prune(paths)
    return {"changed": changed, "switched": switched, "pid": supervisor.running()}


def _state_folder(paths: TargetPaths, account: str) -> None:
    paths.state.mkdir(parents=True, exist_ok=True)
    if paths.root == Path("/"):
        shutil.chown(paths.state, account, account)
    paths.state.chmod(0o755)


def _place_venv(paths: TargetPaths, wanted: Wanted) -> None:
    """Places the dependencies: a venv that sees the system's packages, filled with the unpacked wheels, without pip."""
    venv = paths.venvs / wanted.venv
    if (venv / "complete").exists():
        return
    shutil.rmtree(venv, ignore_errors=True)
    words = [wanted.python, "-m", "venv", "--without-pip", "--system-site-packages", str(venv)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise Refused(f"`{' '.join(words)}` failed: {(done.stderr or done.stdout).strip()}")
    site = next(venv.glob("lib/python3*/site-packages"))
    for item in (paths.incoming / "site").iterdir():
        shutil.move(item, site / item.name)
    give_to_root(site, account="root")
    compileall.compile_dir(str(site), quiet=2, workers=0)
    (venv / "complete").touch()


def _place_release(paths: TargetPaths, wanted: Wanted, account: str) -> None:
    release = paths.releases / wanted.release
    if (release / "release.json").exists():
        return
    shutil.rmtree(release, ignore_errors=True)
    paths.releases.mkdir(parents=True, exist_ok=True)
    shutil.move(paths.incoming / "release", release)
    (release / "venv").symlink_to(Path("../../venvs") / wanted.venv)
    give_to_root(release, account=account)
    compileall.compile_dir(str(release), quiet=2, maxlevels=8)


def _switch(paths: TargetPaths, wanted: Wanted, supervisor: Supervisor) -> bool:
    """Switches to the release; False if it runs already, just so."""
    before = paths.release_of(paths.current)
    new_unit = supervisor.install(_unit_of(paths, wanted.release))
    if before == wanted.release and not new_unit and supervisor.running():
        return False
    _other_supervisor(paths, wanted).remove()
    if before and before != wanted.release:
        point(paths.previous, paths.releases / before)
    point(paths.current, paths.releases / wanted.release)
    try:
        supervisor.start()
        up = stays_up(supervisor, seconds=wanted.settle_s)
        reason = "it ended by itself"
    except Refused as error:
        up, reason = False, str(error)
    if not up:
        log = supervisor.log()
        what = _back(paths, supervisor) if before != wanted.release else "it is the release that was there before"
        raise Refused(f"The new release did not stay up ({reason}); {what}. Its log ends:\n{log}")
    return True


def _other_supervisor(paths: TargetPaths, wanted: Wanted) -> Supervisor:
    """Returns the one that is not wanted, which may run an agent from an earlier deployment."""
    return supervisor_of("none" if wanted.supervisor == "systemd" else "systemd", paths, account="root")


def _unit_of(paths: TargetPaths, release: str) -> str:
    return (paths.releases / release / f"{SERVICE}.service").read_text()


def _back(paths: TargetPaths, supervisor: Supervisor) -> str:
    """Switches from the current release to the one before, or to nothing, and deletes it; says what it did."""
    bad, before = paths.release_of(paths.current), paths.release_of(paths.previous)
    supervisor.stop()
    if before and (paths.releases / before).is_dir():
        point(paths.current, paths.releases / before)
        paths.previous.unlink()
        supervisor.install(_unit_of(paths, before))
        supervisor.start()
        done = f"rolled back to release {before}, which runs again"
    else:
        supervisor.remove()
        paths.current.unlink()
        done = "there was none before it, so the agent is stopped and disabled"
    shutil.rmtree(paths.releases / bad, ignore_errors=True)
    return done


def roll_back(root: str, supervisor: str) -> dict[str, Any]:
    """Switches back to the previous release; the current one is deleted.

    Raises:
        Refused: if nothing is installed.
    """
    paths = TargetPaths(Path(root))
    if not paths.release_of(paths.current):
        raise Refused("Nothing is installed, so there is nothing to roll back")
    account = ensure_account(wanted=root == "/")
    return {"did": _back(paths, supervisor_of(supervisor, paths, account=account))}


def uninstall(root: str, *, purge: bool) -> dict[str, Any]:
    """Removes all that deployments have put there; the calibrations too with `purge`."""
    paths = TargetPaths(Path(root))
    supervisor_of("systemd", paths, account="root").remove()
    supervisor_of("none", paths, account="root").remove()
    clock.forget(paths)
    shutil.rmtree(paths.home, ignore_errors=True)
    if paths.state.is_dir() and (purge or not any(paths.state.iterdir())):
        shutil.rmtree(paths.state)
    if root == "/":
        remove_account()
    return {"left": [str(paths.state)] if paths.state.exists() else []}


def status(root: str, supervisor: str) -> dict[str, Any]:
    """Tells what is installed and if it runs."""
    paths = TargetPaths(Path(root))
    agent = supervisor_of(supervisor, paths, account="root")
    return {
        "current": paths.release_of(paths.current),
        "previous": paths.release_of(paths.previous),
        "releases": _names(paths.releases),
        "venvs": [name for name in _names(paths.venvs) if (paths.venvs / name / "complete").exists()],
        "pid": agent.running(),
        "log": agent.log(),
        "clock": clock.tracking(),
    }


def _names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir()) if folder.is_dir() else []


def _prune(paths: TargetPaths) -> None:
    """Deletes the oldest releases beyond `KEPT`, and the dependencies that no release uses."""
    in_use = {paths.release_of(paths.current), paths.release_of(paths.previous)}
    others = [path for path in paths.releases.iterdir() if path.name not in in_use]
    others.sort(key=lambda path: path.stat().st_mtime, reverse=True)
    for path in others[max(KEPT - len(in_use), 0) :]:
        shutil.rmtree(path)
    used = {(path / "venv").readlink().name for path in paths.releases.iterdir()}
    for path in paths.venvs.iterdir():
        if path.name not in used:
            shutil.rmtree(path)
