"""Derives from a recording what it says was derived.

These are the corners of the block and of the plate's fiducials from the pictures, the attitudes from the joints, and
decisions and samples from the messages.

Each part is `identical`, `different` or `not derived`. A recording is a stranger's: whoever forged all of it
consistently, pictures included, is found out by no derivation; only a signature says who made it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from itertools import chain
from pathlib import Path
from typing import Any, Literal

from shared.errors import UserError
from station.app.attached import attached_rig
from station.app.attitudes_again import attitudes_again
from station.app.commands.check import machine_of
from station.app.corners_again import CornersAgain, MarkTopic, corners_again, picture_tracker
from station.app.described_otherwise import Otherwise, described_otherwise
from station.app.outputs import without_nan
from station.app.recordings import other_rule
from station.app.signature import Signature, file_sha256, signature_path
from station.recording.counts import METADATA as COUNTS
from station.recording.malformed import left_out
from station.recording.numbered import Numbered
from station.recording.parted import is_first
from station.recording.reader import RecordingReader, open_recording
from station.rig.placed_arm import placed_arm
from station.sampling.machine import INPUTS
from station.sampling.replay import DECISIONS, Difference, Verdict, replay

State = Literal["identical", "different", "not derived"]
COMMANDS, EVENTS, SAMPLES = DECISIONS


@dataclass(frozen=True, slots=True)
class Mismatch:
    """A difference between a recording and what follows from it: topic, stamp (ns), field, and both values.

    `field` is empty, and one value None, where a whole message is missing on one side.
    """

    topic: str
    stamp_ns: int
    field: str
    recorded: Any
    derived: Any

    def __str__(self) -> str:
        """Returns the difference in one line."""
        what = f", {self.field}" if self.field else ""
        return f"/{self.topic} at {self.stamp_ns} ns{what}: recorded {self.recorded}, derived {self.derived}"


@dataclass(frozen=True, slots=True)
class Part:
    """One part: its name, how it came out, how many were compared, in words, and where it differs first."""

    name: str
    state: State
    count: int
    sentence: str
    mismatch: Mismatch | None = None


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
    derived = (_corners(reader), _attitudes(reader), *_decisions(reader), _plate(reader))
    # Messages that are none are known once all is read.
    parts = (_content(reader), *derived)
    return Verification(path, sha256, parts, _signature(path, sha256, keys), dict(reader.malformed))


def _signature(path: Path, sha256: str, keys: Path | None) -> Signature | None:
    if not signature_path(path).exists():
        return None
    # Who has no signatures needs no cryptography.
    from station.app.signing import signature_of  # noqa: PLC0415

    return signature_of(path, sha256=sha256, keys=keys)


def _content(reader: RecordingReader) -> Part:
    """Compares the files with what they say of themselves: their parts, their counts, and the metadata.

    These have checksums, and say of the session what the attached rig file and plan do.

    A wrong checksum of a chunk or an attachment raises UserError.
    """
    names = [name for name, info in reader.topics.items() if info.message and not name.startswith("truth/")]
    numbered, count = Numbered(from_the_first=is_first(reader)), 0
    for channels, batch in reader.batches(names):
        numbered.take(channels, batch)
        count += len(batch.log_ns)
    changed, others = reader.changed_metadata, _otherwise(reader)
    lost = {"part": reader.parts_missing, COUNTS: reader.miscounted, "sequence": list(numbered.sentences())}
    said = list(chain.from_iterable(lost.values()))
    if changed:
        said.append(f"metadata {', '.join(map(repr, changed))} is not as it was written")
    said += map(str, others)
    if said:
        name = next(iter([*changed, *(one for one, faults in lost.items() if faults)]), "")
        line = (others[0].line, others[0].said, others[0].attached) if others else (name, "", "")
        where = Mismatch("metadata", reader.start_ns, *line)
        return Part("content", "different", count, _with_left_out("; ".join(said), reader), where)
    attached = len(reader.attachments)
    words = f"{count} messages and {attached} attached files match their checksums{_untold(reader, numbered)}"
    return Part("content", "identical", count, _with_left_out(words, reader))


def _untold(reader: RecordingReader, numbered: Numbered) -> str:
    """Returns what nothing in the file would tell of missing messages."""
    if COUNTS in reader.metadata:
        return ""
    where = "in it" if numbered.nothing_numbered else "at a topic's end"
    return f"; it has no record of counts, so that what may be missing {where} is not told"


def _otherwise(reader: RecordingReader) -> list[Otherwise]:
    try:
        return list(described_otherwise(reader))
    except UserError:  # the attached file is no TOML, which the parts that need it say
        return []


def _with_left_out(words: str, reader: RecordingReader) -> str:
    return f"{words}. {left_out(reader.malformed)}".removesuffix(". ")


def _corners(reader: RecordingReader) -> Part:
    found = _read_again(reader, "corners", "camera/corners")
    if isinstance(found, CornersAgain) and found.stampless > found.pictures:
        said = f"{found.stampless} of {found.stampless + found.pictures} pictures are of moments without corners"
        return Part("corners", "different", found.compared, said)
    return _part_of("corners", "camera/corners", found) if isinstance(found, CornersAgain) else found


def _plate(reader: RecordingReader) -> Part:
    """Compares the plate's fiducials, which come in turn: most pictures show one or two whose turn it was."""
    found = _read_again(reader, "plate", "camera/plate")
    return _part_of("plate", "camera/plate", found) if isinstance(found, CornersAgain) else found


def _read_again(reader: RecordingReader, name: str, topic: MarkTopic) -> CornersAgain | Part:
    rig = attached_rig(reader)
    if rig is None or not {"camera/image", topic} <= reader.topics.keys():
        return Part(name, "not derived", 0, f"the recording holds no pictures, no /{topic}, or no rig file")
    try:
        tracker = picture_tracker(rig, reader.attachments.get("calibration.toml", b"").decode("utf-8", "replace"))
    except UserError as error:
        return Part(name, "not derived", 0, str(error))
    return corners_again(reader, tracker, topic=topic)


def _part_of(part: str, topic: MarkTopic, found: CornersAgain) -> Part:
    read = f"{found.compared} of {found.corners} read again, in {found.compared} of {found.pictures} pictures"
    if not found.compared:
        return Part(part, "not derived", 0, f"no picture shows the mark ({found.pictures} pictures)")
    said = f"{read}, at most {found.worst_px:.3f} px apart" + (
        f"; in {found.unseen} the mark was found then and not now" if found.unseen else ""
    )
    if unshown := found.corners - found.compared - found.unseen:
        said += f"; of {unshown} there is no picture"
    said += "; their sigma_px does not follow from a packed picture"
    if found.first is None:
        return Part(part, "identical", found.compared, said)
    first = found.first
    name = f"corners_px[{first.number}]"
    where = Mismatch(topic, first.stamp_ns, name, first.recorded_px, first.derived_px)
    return Part(part, "different", found.compared, f"{read}; {found.different} differ", where)


def _attitudes(reader: RecordingReader) -> Part:
    rig = attached_rig(reader)
    if rig is None or not {"arm/joints", "arm/platform"} <= reader.topics.keys():
        return Part("attitudes", "not derived", 0, "the recording holds no joints, or no rig file")
    try:
        found = attitudes_again(reader, placed_arm(rig))
    except UserError as error:
        return Part("attitudes", "not derived", 0, str(error))
    read = f"{found.compared} of {found.attitudes} follow from the joints of their moment"
    if not found.compared:
        return Part("attitudes", "not derived", 0, read)
    if found.first is None:
        return Part("attitudes", "identical", found.compared, read)
    first = found.first
    where = Mismatch("arm/platform", first.stamp_ns, first.name, first.recorded, first.derived)
    said = f"of {found.compared} with joints of their moment {found.different} do not follow from them"
    return Part("attitudes", "different", found.compared, said, where)


def _decisions(reader: RecordingReader) -> Sequence[Part]:
    try:
        machine = machine_of(reader)
    except UserError as error:
        return [Part(name, "not derived", 0, str(error)) for name in ("decisions", "samples")]
    stream = ((item.topic, item.message, item.log_ns) for item in reader.messages({*INPUTS, *DECISIONS}))
    verdicts = replay(machine, stream)
    decided = {topic: verdicts[topic] for topic in (COMMANDS, EVENTS)}
    samples, why = {SAMPLES: verdicts[SAMPLES]}, other_rule(reader)
    return [_compared("decisions", decided, why=why), _compared("samples", samples, why=why)]


def _compared(name: str, verdicts: dict[str, Verdict], *, why: str) -> Part:
    """Compares decisions; `why` those of an honest recording may differ, too, is said where they do."""
    count = sum(verdict.decisions for verdict in verdicts.values())
    found = [_mismatch(topic, verdict.difference) for topic, verdict in verdicts.items() if verdict.difference]
    if not found:
        return Part(name, "identical", count, f"all {count} follow from the recorded messages")
    said = "; ".join(filter(None, (f"after {count} that follow", why)))
    return Part(name, "different", count, said, min(found, key=lambda one: one.stamp_ns))


def _mismatch(topic: str, difference: Difference) -> Mismatch:
    name, recorded, derived = difference.changed
    return Mismatch(topic, difference.stamp_ns, name, recorded, derived)


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
