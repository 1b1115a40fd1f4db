"""Compares what a recording's metadata say of the session with the rig file and the plan that it carries."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from shared.visible import visible
from station.app.attached import attached_table
from station.recording.reader import RecordingReader

_SAID = (("rig_id", "rig.toml", "id"), ("seed", "plan.toml", "seed"))
"""The lines of the record `session` that stand in an attached file as well: line, file, and the value's name there.
Mode and start stand nowhere else."""


@dataclass(frozen=True, slots=True)
class Otherwise:
    """A line of the record `session` and the value of the attached file, which is another one."""

    line: str
    said: str
    file: str
    attached: str

    def __str__(self) -> str:
        """Returns the difference in words."""
        return visible(
            f"metadata 'session' says {self.line} '{self.said}', and the attached {self.file} '{self.attached}'"
        )


def described_otherwise(reader: RecordingReader) -> Iterator[Otherwise]:
    """Yields each line of the session's metadata that an attached file contradicts; who lacks it says nothing.

    Raises:
        UserError: if an attached file is not TOML.
    """
    session = reader.metadata.get("session", {})
    for line, file, name in _SAID:
        said, table = session.get(line, ""), attached_table(reader, file)
        attached = "" if table is None else str(table.values.get(name, ""))
        if said and attached and said != attached:
            yield Otherwise(line, said, file, attached)
