"""The agent's own system account; only root can make one, so an installation below a folder runs as who made it."""

from __future__ import annotations

import grp
import os
import pwd
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from .paths import ACCOUNT, Refused

GROUPS = ("video", "render")
"""Debian's groups of camera and memory-heap devices; one that is missing is passed over."""


def ensure_account(*, wanted: bool) -> str:
    """Returns the account that the agent runs as; created if it is missing.

    Raises:
        Refused: if it cannot be created.
    """
    if not wanted:
        return pwd.getpwuid(os.geteuid()).pw_name
    groups = ",".join(name for name in GROUPS if _exists(name))
    if not _known():
        words = ["useradd", "--system", "--user-group", "--no-create-home", "--home-dir", "/var/lib/repose"]
        _call([*words, "--shell", "/usr/sbin/nologin", *(["--groups", groups] if groups else []), ACCOUNT])
    elif groups:
        _call(["usermod", "--append", "--groups", groups, ACCOUNT])
    return ACCOUNT


def remove_account() -> None:
    """Removes the account, if there is one."""
    if _known():
        _call(["userdel", ACCOUNT])


def give_to_root(folder: Path, *, account: str) -> None:
    """Makes a tree root's own, readable by all; what lies under `keys` is the agent's, which takes no key of others."""
    for path in [folder, *folder.rglob("*")]:
        secret = "keys" in path.relative_to(folder).parts
        if os.geteuid() == 0:
            shutil.chown(path, account if secret else "root", identity_of(account).group if secret else "root")
        if not path.is_symlink():
            runs = path.is_dir() or bool(path.stat().st_mode & 0o100)
            path.chmod((0o700 if runs else 0o600) if secret else (0o755 if runs else 0o644))


@dataclass(frozen=True)
class Identity:
    """Whom a child process runs as; all None: as this process itself."""

    user: str | None = None
    group: str | None = None
    groups: list[str] | None = None


def identity_of(account: str) -> Identity:
    """Returns the account with its camera groups, if this process may change to it."""
    if os.geteuid() != 0:
        return Identity()
    group = grp.getgrgid(pwd.getpwnam(account).pw_gid).gr_name
    return Identity(account, group, [name for name in GROUPS if _exists(name)])


def _known() -> bool:
    try:
        pwd.getpwnam(ACCOUNT)
    except KeyError:
        return False
    return True


def _exists(group: str) -> bool:
    try:
        grp.getgrnam(group)
    except KeyError:
        return False
    return True


def _call(words: list[str]) -> None:
    path = os.environ.get("PATH", "") + ":/usr/sbin:/sbin"
    done = subprocess.run(words, capture_output=True, text=True, check=False, env={**os.environ, "PATH": path})
    if done.returncode != 0:
        raise Refused(f"`{' '.join(words)}` failed: {done.stderr.strip()}")
