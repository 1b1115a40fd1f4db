"""Derives from a recording what it says was derived.

These are the corners of the block and of the plate's fiducials from the pictures, the attitudes from the joints, and
decisions and samples from the messages.

Each part is `identical`, `different` or `not derived`. A recording is a stranger's: whoever forged all of it
consistently, pictures included, is found out by no derivation; only a signature says who made it.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from station.app.outputs import without_nan
from station.app.signature import Signature, file_sha256, signature_path
from station.app.verified import attitudes, content, decisions, marks
from station.app.verified.part import Mismatch, Part
from station.recording.reader import open_recording


@dataclass(frozen=True, slots=True)
class Verification:
    """Everything that was found about one recording."""

    path: Path
    sha256: str
    parts: tuple[Part, ...]
    signature: Signature | None
    left_out: dict[str, int] = field(default_factory=dict[str, int])
    """Payloads by topic that are no message of it."""

    @property
    def first(self) -> Mismatch | None:
        """The first difference by its stamp."""
        found = [part.mismatch for part in self.parts if part.mismatch is not None]
        return min(found, key=lambda mismatch: mismatch.stamp_ns, default=None)

    @property
    def holds(self) -> bool:
        """True if something was derived, or signed, and nothing differs."""
        states = {part.state for part in self.parts}
        signed = self.signature is not None and not self.signature.fault
        said = "identical" in {part.state for part in self.parts if part.name != "content"} or signed
        return said and "different" not in states and (self.signature is None or signed)

    def as_json(self) -> dict[str, Any]:
        """Returns everything, for scripts; what JSON cannot say is null."""
        parts = [without_nan(asdict(part)) for part in self.parts]
        first = None if self.first is None else without_nan(asdict(self.first))
        signature = None if self.signature is None else asdict(self.signature)
        return {
            "file": str(self.path),
            "sha256": self.sha256,
            "holds": self.holds,
            "parts": parts,
            "first_difference": first,
            "signature": signature,
            "left_out": self.left_out,
        }


def verify(path: Path, *, keys: Path | None = None) -> Verification:
    """Derives a recording's corners, of block and plate, attitudes, decisions and samples again.

    Raises:
        UserError: if the file cannot be read, is damaged, or what stands beside it is no signature.
    """
    reader = open_recording(path)
    sha256 = file_sha256(path)
    derived = [marks.corners(reader), attitudes.part(reader), *decisions.parts(reader), marks.plate(reader)]
    # Messages that are none are known once all is read.
    parts = (content.part(reader), *derived)
    return Verification(path, sha256, parts, _signature(path, sha256, keys), dict(reader.malformed))


def _signature(path: Path, sha256: str, keys: Path | None) -> Signature | None:
    if not signature_path(path).exists():
        return None
    # Who has no signatures needs no cryptography.
    from station.app.signing import signature_of  # noqa: PLC0415

    return signature_of(path, sha256=sha256, keys=keys)
