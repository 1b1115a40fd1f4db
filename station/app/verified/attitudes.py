"""Derives the plate's attitudes again from the joints of their moment."""

from __future__ import annotations

from shared.errors import UserError
from station.app.attached import attached_rig
from station.app.attitudes_again import attitudes_again
from station.app.verified.part import Mismatch, Part
from station.recording.reader import RecordingReader
from station.rig.placed_arm import placed_arm


def part(reader: RecordingReader) -> Part:
    """Returns the part `attitudes`."""
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
