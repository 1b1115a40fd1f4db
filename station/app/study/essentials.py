"""What a session of the study records: all that measuring, replaying and checking read, and no more.

The arm's joints, the transforms for viewers and the simulation's truth are two thirds of a session's bytes and nothing
that measures reads them: the plate's attitude and the marks say the same. What is left out stands in the recording's
metadata (`recorder`, "left_out TOPIC"). The sampling machine's inputs are all there, so that a replay takes the same
decisions.
"""

from __future__ import annotations

from shared.bus import Received
from station.recording.recorder import Sink

LEFT_OUT = frozenset({"arm/joints", "tf", "truth/scene"})


class Essentials:
    """A sink before another one that lets pass what is not left out."""

    def __init__(self, sink: Sink) -> None:
        self._sink = sink

    @property
    def stopped(self) -> str:
        """Why the recording stopped, if it did."""
        return self._sink.stopped

    def write(self, received: Received) -> None:
        """Records one message unless it is left out."""
        if received.topic not in LEFT_OUT:
            self._sink.write(received)


def metadata() -> dict[str, str]:
    """What is left out, for the recording's metadata record `recorder`."""
    return {f"left_out {topic}": "1" for topic in sorted(LEFT_OUT)}
