"""Recordings elsewhere (`s3://…`, `https://…`): which there are, and a copy of each on this machine.

A copy is kept in the user's cache under the address and the store's own mark of this version (its ETag, or the time of
the last change). Where a store has no such mark, the recording is fetched anew each time. Access keys and the like are
the store's matter: fsspec takes them from the environment.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import threading
from collections.abc import Generator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from shared.errors import UserError
from shared.installed import to_install
from station.recording.parted import continued_in
from station.recording.parts import number_of, part_path
from station.recording.reader import open_file

CACHE = Path.home() / ".cache" / "repose" / "recordings"
CACHE_NAMED_BY = "REPOSE_CACHE"
"""The variable of the environment that names another folder for the copies."""
_MARKS = ("ETag", "etag", "LastModified", "last_modified", "mtime", "created", "generation", "md5", "Content-MD5")


def is_remote(name: str) -> bool:
    """Returns true for an address."""
    return "://" in name


def is_file(address: str) -> bool:
    """Returns true if a file has this address; False for a folder and a glob.

    Raises:
        UserError: if there is neither, or the store does not answer.
    """
    with _said(address):
        system, path = _store(address)
        if address.endswith("/"):
            return False
        try:
            return system.info(path)["type"] != "directory"
        except FileNotFoundError:
            if _is_glob(address):
                return False
            raise


def within(address: str, *, kinds: tuple[str, ...], recordings: tuple[str, ...]) -> list[str]:
    """Returns the addresses in a folder that end like `recordings`, or those that match a glob and end like `kinds`.

    Raises:
        UserError: if the store does not answer.
    """
    with _said(address):
        system, path = _store(address)
        found = system.glob(path) if _is_glob(address) else system.find(path)
    ending = kinds if _is_glob(address) else recordings
    return sorted(system.unstrip_protocol(one) for one in found if one.endswith(ending))


def local(name: str) -> Path:
    """Gives the file on this machine: that of the name, or the copy of what is elsewhere, which is whole or not there.

    Raises:
        UserError: if it cannot be fetched.
    """
    return _with_parts(name) if is_remote(name) else Path(name)


def _with_parts(address: str) -> Path:
    """Returns the copy of a recording; the parts in which it goes on lie beside it, as far as the store has them."""
    first = _fetched(address)
    parts = [first]
    while first.suffix == ".mcap" and number_of(first.name) == 1 and _goes_on(parts[-1]):
        after = part_path(first, len(parts) + 1)
        elsewhere = address.removesuffix(first.name) + after.name
        if not after.exists():
            with suppress(UserError):  # it is missing there, which is told when the recording is read
                shutil.copyfile(_fetched(elsewhere), after)
        if not after.exists():
            break
        parts.append(after)
    return first


def _goes_on(path: Path) -> bool:
    try:
        return bool(continued_in(open_file(path)))
    except UserError:  # damaged: said when it is read
        return False


def _fetched(address: str) -> Path:
    with _said(address):
        system, path = _store(address)
        info = system.info(path)
        mark = [str(info[name]) for name in _MARKS if info.get(name)]
        key = hashlib.sha256("\n".join([address, str(info.get("size")), *mark]).encode()).hexdigest()
        copy = _cache() / key[:20] / path.partition("?")[0].rpartition("/")[2]
        if not (mark and copy.exists()):
            copy.parent.mkdir(parents=True, exist_ok=True)
            growing = copy.with_name(f"{copy.name}.{os.getpid()}-{threading.get_ident()}.fetched")
            try:
                system.get_file(path, str(growing))
                _require_whole(growing, info.get("size"))
                os.replace(growing, copy)
            finally:
                growing.unlink(missing_ok=True)
        return copy


def _require_whole(path: Path, size: int | None) -> None:
    come = path.stat().st_size
    if size is not None and come != size:
        raise OSError(f"{come} of {size} bytes came")


def _cache() -> Path:
    named = os.environ.get(CACHE_NAMED_BY)
    return Path(named) if named else CACHE


def _is_glob(address: str) -> bool:
    """Returns true for a glob; a question mark begins the query of a web address."""
    return bool(set("*[") & set(address)) or ("?" in address and not address.startswith("http"))


def _store(address: str) -> tuple[Any, str]:
    import fsspec  # noqa: PLC0415  # an extra, and slow to load

    return fsspec.core.url_to_fs(address)


@contextmanager
def _said(address: str) -> Generator[None]:
    """Says in one sentence what a store's own library raises, which has errors of its own kinds.

    Raises:
        UserError: instead of it.
    """
    try:
        yield
    except (UserError, ModuleNotFoundError):
        raise
    except FileNotFoundError as error:
        raise UserError(f"Expected a recording at {address}, but there is none") from error
    except ImportError as error:
        wanted = f"Expected the package that reads {address}, which is not installed ({error})"
        raise UserError(f"{wanted}; run: {to_install('remote')}") from error
    except Exception as error:
        raise UserError(f"Expected to fetch {address}, but that failed: {error or type(error).__name__}") from error
