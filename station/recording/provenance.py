"""Tells the origin of a recording: versions, rig file, plan, seed, calibration."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from typing import Literal

from shared import installed

_PACKAGES = ("eclipse-zenoh", "mcap", "mujoco", "numpy", "opencv-python-headless", "protobuf", "rerun-sdk")


def versions() -> dict[str, str]:
    """Returns the versions of this program, of Python and of the libraries that shape a measurement."""
    found = {"python": platform.python_version(), "platform": platform.platform(), "repose": installed.version()}
    for name in _PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def whole_number(text: str) -> int | None:
    """Returns the number of 0 to 2^63 − 1 in a metadata value; None if it is none, as anything may stand there."""
    number = int(text) if text.isascii() and text.isdigit() and len(text) <= len(str(2**63)) else -1
    return number if 0 <= number < 2**63 else None


CHECKSUM = "sha256"
"""The line of a metadata record that has the checksum of its others: MCAP has none for these records."""


def sealed(values: Mapping[str, str]) -> dict[str, str]:
    """Returns the values of a metadata record with their checksum, the SHA-256 of their JSON with sorted keys."""
    return {**values, CHECKSUM: _checksum(values)}


def is_intact(record: Mapping[str, str]) -> bool:
    """Returns true if a record is as it was sealed, or never was.

    Older recordings and other writers have no checksum.
    """
    return CHECKSUM not in record or record[CHECKSUM] == _checksum(record)


def _checksum(values: Mapping[str, str]) -> str:
    others = {name: value for name, value in values.items() if name != CHECKSUM}
    return hashlib.sha256(json.dumps(others, sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True, kw_only=True)
class Attachment:
    """A file carried inside a recording."""

    name: str
    data: bytes
    media_type: str = "text/plain"


@dataclass(frozen=True, kw_only=True)
class Provenance:
    """The words of a recording about its own making.

    `rig_toml` and `plan_toml` are the files word by word; `calibration` is the calibration file, if there is one.
    `mode` says what produced the data. `extra` holds further lines, `attachments` further files (a licence, say).
    """

    rig_id: str
    started_ns: int
    mode: Literal["live", "lockstep", "import"] = "live"
    seed: int | None = None
    rig_toml: str = ""
    own_rig: bool = False
    """True if that rig file is the user's own, which may name a file as its arm's model."""
    plan_toml: str = ""
    calibration: str = ""
    versions: Mapping[str, str] = field(default_factory=versions)
    extra: Mapping[str, str] = field(default_factory=dict[str, str])
    attachments: tuple[Attachment, ...] = ()

    def session(self) -> dict[str, str]:
        """Returns the metadata record `session`."""
        seed = "" if self.seed is None else str(self.seed)
        own = {"rig_id": self.rig_id, "started_ns": str(self.started_ns), "mode": self.mode, "seed": seed}
        return {**own, **self.extra}

    def files(self) -> tuple[Attachment, ...]:
        """Returns everything that is attached."""
        texts = {"rig.toml": self.rig_toml, "plan.toml": self.plan_toml, "calibration.toml": self.calibration}
        own = (Attachment(name=name, data=text.encode()) for name, text in texts.items() if text)
        return (*own, *self.attachments)
