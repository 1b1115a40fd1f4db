"""The same work for each recording, where one that cannot be read stops no other.

With an output folder, a result is a file named by the digest of the recording's content and by the version of what
computes it. What is there is not computed again, whatever the recording is called by now. Results are written as they
come, each whole or not at all, so that whatever breaks the work off, the same command goes on from there.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

from shared.errors import UserError
from station.app.many.key import digest_of, key_of
from station.app.many.remote import is_remote, local
from station.app.work import write_json
from station.pool import spread

Result = Mapping[str, Any]
"""The findings of a command in a recording, as JSON has them."""
Work = Callable[[Path, str], Result]
"""Takes the file on this machine and the recording's name. It is a function of a module, or a `partial` of one."""
Status = Literal["done", "kept", "failed"]
RESULTS = "_results"
"""The folder of the results; readers of datasets pass over names that begin like this."""
_DIGITS = 16
"""The digits of a recording's digest in a file's name, and half of them of the version."""


@dataclass(frozen=True, kw_only=True)
class Kept:
    """A folder of results of one version. `named_by` is the entry of a result that has the recording's name.

    A result may list `files` that were written with it, by their paths in the folder. It counts while they are there
    and the recording, whose name is in them, is called the same.
    """

    folder: Path
    key: str
    named_by: str = "recording"

    @classmethod
    def of(cls, folder: Path, command: str, asked: Mapping[str, Any], *, named_by: str = "recording") -> Kept:
        """Returns the results of a command with these options, as they are now."""
        return cls(folder=folder.absolute(), key=key_of(command, asked), named_by=named_by)

    def stem(self, digest: str) -> str:
        """Returns the name of what belongs to a recording of this digest, without its ending."""
        return f"{digest[:_DIGITS]}-{self.key[: _DIGITS // 2]}"

    def file(self, digest: str) -> Path:
        """Returns the file of a recording's result."""
        return self.folder / RESULTS / f"{self.stem(digest)}.json"

    def found(self, digest: str, name: str) -> Result | None:
        """Returns the result that is there, under the present name of the recording.

        It is None if there is none that is whole.
        """
        try:
            result: dict[str, Any] = json.loads(self.file(digest).read_text(encoding="utf-8"))
            files = result.get("files", ())
            whole = all((self.folder / one).exists() for one in files) and not (files and result[self.named_by] != name)
        except (OSError, ValueError, AttributeError, KeyError):
            return None
        return {**result, self.named_by: name} if whole else None


@dataclass(frozen=True, kw_only=True)
class Row:
    """One recording: its result, or the reason why there is none; the digest of its content where it could be read.

    A result is `kept` if it was there already. `file` is its path in the output folder.
    """

    recording: str
    status: Status
    result: Result
    reason: str = ""
    digest: str = ""
    file: str = ""
    seconds: float = 0.0


def each(
    names: Sequence[str],
    work: Work,
    *,
    kept: Kept | None = None,
    jobs: int = 0,
    as_it_comes: Callable[[Row], None] = lambda _: None,
) -> list[Row]:
    """Works on every recording; gives the rows in the order of the names.

    Args:
        names: paths or addresses.
        work: what is done with each.
        kept: where results are kept, and looked for.
        jobs: as `spread` takes it.
        as_it_comes: is called with each row once it is there.
    """
    rows: dict[str, Row] = {}
    tasks = [(name, name if is_remote(name) else str(Path(name).absolute())) for name in names]
    with spread(partial(row_of, work=work, kept=kept), tasks, jobs=jobs, in_order=False) as done:
        for row in done:
            rows[row.recording] = row
            as_it_comes(row)
    return [rows[name] for name in names]


def row_of(task: tuple[str, str], *, work: Work, kept: Kept | None) -> Row:
    """Works on one recording; what goes wrong with it is in its row.

    A task is its name and its location: a worker elsewhere in a cluster has another working folder.
    """
    began, (name, location) = time.monotonic(), task
    try:
        return _row(name, location, work, kept, began)
    except UserError as error:
        reason = str(error)
    except Exception as error:
        reason = f"this program failed at it ({type(error).__name__}: {error}), which is a fault of ours"
    return Row(recording=name, status="failed", result={}, reason=reason, seconds=time.monotonic() - began)


def _row(name: str, location: str, work: Work, kept: Kept | None, began: float) -> Row:
    path = local(location)
    digest = _digest(path)
    found = kept.found(digest, name) if kept else None
    result = work(path, name) if found is None else found
    if kept and found is None:
        _write(kept.file(digest), result)
    return Row(
        recording=name,
        status="done" if found is None else "kept",
        result=result,
        digest=digest,
        file=kept.file(digest).relative_to(kept.folder).as_posix() if kept else "",
        seconds=time.monotonic() - began,
    )


def _digest(path: Path) -> str:
    try:
        return digest_of(path)
    except OSError as error:
        raise UserError(f"Expected a recording at {path}, but it cannot be read: {error.strerror}") from error


def _write(path: Path, result: Result) -> None:
    try:
        write_json(path, result)
    except OSError as error:
        raise UserError(f"Expected to write the result to {path}, but that failed: {error.strerror}") from error
