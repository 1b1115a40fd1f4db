"""The table `[notify]` of a rig file: who is told of a session that needs somebody. It stays with the rig's owner.

An address for notifications is a secret: whoever has it may send there. It is in no recording and on no other machine,
because the text of a rig file is handed on without this table.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Literal
from urllib.parse import urlsplit

from shared.config import Table
from shared.errors import UserError

NAME = "notify"
Kind = Literal["fault", "disk", "mark", "outage", "end"]
KINDS: tuple[Kind, ...] = ("fault", "disk", "mark", "outage", "end")
_LEFT_OUT = "# [notify] stood here. It names who is told of faults, and is no part of a measurement.\n"
_HEADER = re.compile(r"\s*\[+\s*([^\]]+?)\s*\]+")


@dataclass(frozen=True, kw_only=True)
class NotifyConfig:
    """`[notify]`: a `url` gets JSON by POST, a `command` (program and arguments, no shell) gets it on its input.

    `on`: the kinds that are told. `mark_s`: how long the mark may be out of sight. `outage_s`: how long a session may
    wait for camera or arm. `quiet_s`: the least time between two of one kind. `timeout_s`: a receiver's time limit.
    """

    url: str = field(default="", repr=False, metadata={"secret": True})
    command: tuple[str, ...] = field(default=(), repr=False, metadata={"secret": True})
    on: tuple[Kind, ...] = KINDS
    mark_s: float = 10.0
    outage_s: float = 60.0
    quiet_s: float = 600.0
    timeout_s: float = 10.0

    def __post_init__(self) -> None:
        if self.url and not _is_web(self.url):
            raise ValueError(
                "expected an address that begins with https:// or http:// and names a host as url, got another"
            )
        if self.command and not self.command[0]:
            raise ValueError("expected a program and its arguments as command, got an empty program")
        for name in ("mark_s", "outage_s", "timeout_s"):
            if not 0 < getattr(self, name) < float("inf"):
                raise ValueError(f"expected a positive number of seconds as {name}, got {getattr(self, name)}")
        if not 0 <= self.quiet_s < float("inf"):
            raise ValueError(f"expected no or more seconds as quiet_s, got {self.quiet_s}")

    @property
    def anybody(self) -> bool:
        """True if there is somebody to tell."""
        return bool(self.url or self.command)


def _is_web(url: str) -> bool:
    try:
        parts = urlsplit(url)
        return parts.scheme in ("http", "https") and bool(parts.hostname) and parts.port != 0 and url.isprintable()
    except ValueError:  # a port that is no number, say
        return False


def without_notify(table: Table) -> str:
    """Returns the text of a rig file without its table `[notify]`, comments in it included.

    Raises:
        UserError: if the table is written in a way in which it cannot be cut out, or its address stands elsewhere, too.
    """
    if NAME not in table.values:
        return table.text
    text = "".join(_other_lines(table.text))
    others = {key: value for key, value in table.values.items() if key != NAME}
    address = table.values[NAME].get("url", "") if isinstance(table.values[NAME], dict) else ""
    if _values(text) != others or (address and str(address) in text):
        raise UserError(
            f"{table.file}: expected all of [notify] once and under a header of its own, because recordings hold the "
            "rest of the file, got it in another form; write the line [notify] and below it its keys"
        )
    return text


def _other_lines(text: str) -> Iterator[str]:
    """Yields the lines of all other tables, with a remark in the place of this one."""
    inside = False
    for line in text.splitlines(keepends=True):
        if header := _HEADER.match(line):
            was, inside = inside, header.group(1).split(".")[0].strip(" \"'") == NAME
            if inside and not was:
                yield _LEFT_OUT
        if not inside:
            yield line


def _values(text: str) -> dict[str, Any] | None:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return None
