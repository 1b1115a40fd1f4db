"""Chooses what a session of the study records: all that measuring, replaying and checking read, and no more.

The arm's joints, the transforms for viewers and the simulation's truth are half of a session's bytes and nothing that
measures reads them: the plate's attitude and the marks say the same. What is left out stands in the recording's
metadata (`recorder`, "left_out TOPIC"). The sampling machine's inputs are all there, so that a replay takes the same
decisions.
"""

from __future__ import annotations

from shared.bus import Received
from station.recording.writer import Recording

LEFT_OUT = frozenset({"arm/joints", "tf", "truth/scene"})


class Essentials(Recording):
    """A recording without the topics that are left out. Describe it (`describe`) once it is open."""

    def write(self, received: Received) -> None:
        """Records one message unless it is left out."""
        if received.topic not in LEFT_OUT:
            super().write(received)

    def describe(self) -> None:
        """Writes what is left out into the metadata."""
        self.add_metadata("recorder", {f"left_out {topic}": "1" for topic in sorted(LEFT_OUT)})
