"""A recording's signature and its file. `signing`, which needs a package, makes and checks it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from shared.bus_keys import VARIABLE
from shared.errors import UserError
from station.recording.parts import sha256_of

SUFFIX = ".sig"


@dataclass(frozen=True, slots=True)
class Signature:
    """A signature. `fault`: why it does not hold; empty if it does. `authority`: whether that was checked."""

    signer: str
    fingerprint: str
    signed_ns: int
    authority: bool = False
    fault: str = ""


def signature_line(signature: Signature | None) -> str:
    """Returns the signer of a recording, in one line."""
    if signature is None:
        return "nobody signed it"
    who = f"{signature.signer} ({signature.fingerprint[:16]}…), {_date(signature.signed_ns)}"
    if signature.fault:
        return f"does not hold: {signature.fault} ({who})"
    return f"signed by {who}" if signature.authority else f"holds, by {who}; whose that is only the rig's --keys tell"


def _date(stamp_ns: int) -> str:
    try:
        return f"{datetime.fromtimestamp(stamp_ns / 1e9, UTC):%Y-%m-%d %H:%M:%S} UTC"
    except (OverflowError, ValueError, OSError):
        return f"{stamp_ns} ns"


def signature_path(recording: Path) -> Path:
    """Returns the file of a recording's signature."""
    return recording.with_name(recording.name + SUFFIX)


def file_sha256(path: Path) -> str:
    """Returns the SHA-256 of a recording's bytes, in all its parts.

    Raises:
        UserError: if it cannot be read.
    """
    try:
        return sha256_of(path)
    except OSError as error:
        raise UserError(f"Expected a recording at {path}, but it cannot be read: {error.strerror}") from error


def keys_folder(given: Path | None, environment: Mapping[str, str] = os.environ) -> Path | None:
    """Returns the folder of keys that was given, or that the environment names; None if there is none."""
    named = environment.get(VARIABLE, "")
    return given or (Path(named) if named else None)
