"""Reads the marks again where pictures were recorded: the corners of the block, and the plate's fiducials."""

from __future__ import annotations

from shared.errors import UserError
from station.app.attached import attached_rig
from station.app.corners_again import CornersAgain, MarkTopic, corners_again, picture_tracker
from station.app.verified.part import Mismatch, Part
from station.recording.reader import RecordingReader


def corners(reader: RecordingReader) -> Part:
    """Returns the part `corners`: those of the block."""
    found = _read_again(reader, "corners", "camera/corners")
    if isinstance(found, CornersAgain) and found.stampless > found.pictures:
        said = f"{found.stampless} of {found.stampless + found.pictures} pictures are of moments without corners"
        return Part("corners", "different", found.compared, said)
    return _part_of("corners", "camera/corners", found) if isinstance(found, CornersAgain) else found


def plate(reader: RecordingReader) -> Part:
    """Returns the part `plate`: its fiducials, which come in turn, so that most pictures show one or two of them."""
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
