"""SceneLogger: the one place where messages become pictures, for recordings and for a running session alike."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence

import rerun as rr

from shared.messages import Message
from station.view.camera import CameraPart
from station.view.canvas import Canvas
from station.view.health import HealthPart
from station.view.part import Handler, PartMaker, Rates
from station.view.plots import DisplacementPart, TiltPart
from station.view.scene_parts import ArmPart, BlockPart, PlatePart
from station.view.session import LogPart, SamplesPart, StatePart
from station.view.setup import Setup

PARTS: tuple[PartMaker, ...] = (
    CameraPart,
    PlatePart,
    ArmPart,
    BlockPart,
    TiltPart,
    DisplacementPart,
    StatePart,
    LogPart,
    SamplesPart,
    HealthPart,
)

NOT_SHOWN = frozenset(
    {
        "camera/image/overlay",  # the corners are drawn from the measurement itself
        "arm/lease",  # which session has the arm: it says nothing of block or plate
        "session/pause",  # the log has a line of it
        "session/status",  # the progress of a session, for those who look on while it runs
        "twin/target",  # the twin's own wire: arm/joints shows its motion as any arm's
        "twin/joints",
        "truth/scene",  # a view shows what was measured, never the truth
    }
)


class SceneLogger:
    """Takes messages of any topic, in any order of topics, and draws them.

    `root` (such as `simulation/`) puts everything below another entity, so that several loggers can share one
    recording; give them the same `start_ns`. `parts` are what is drawn. Messages whose numbers make no sense are not
    drawn; `refused` counts them by topic.
    """

    def __init__(
        self,
        recording: rr.RecordingStream,
        *,
        setup: Setup,
        rates: Rates | None = None,
        root: str = "",
        start_ns: int | None = None,
        parts: Sequence[PartMaker] = PARTS,
    ) -> None:
        self.refused: Counter[str] = Counter()
        self._canvas = Canvas(recording, root=root, start_ns=start_ns)
        self._exact: defaultdict[str, list[Handler]] = defaultdict(list)
        self._prefixes: list[tuple[str, Handler]] = []
        for make in parts:
            for topic, handler in make(self._canvas, setup, rates or Rates()).handlers().items():
                if topic.endswith("/"):
                    self._prefixes.append((topic, handler))
                else:
                    self._exact[topic].append(handler)

    def wants(self, topic: str) -> bool:
        """Returns true if any part draws this topic: whoever feeds the logger need not decode the others."""
        return topic in self._exact or any(topic.startswith(prefix) for prefix, _ in self._prefixes)

    def log(self, topic: str, message: Message, stamp_ns: int) -> None:
        """Draws a message at the time at which it happened."""
        handlers = [*self._exact.get(topic, ()), *(take for prefix, take in self._prefixes if topic.startswith(prefix))]
        if handlers:
            self._canvas.at(stamp_ns)
        for handler in handlers:
            try:
                handler(message)
            except (ValueError, ArithmeticError, IndexError):  # corners that are not four, an attitude of zeros
                self.refused[topic] += 1

    @property
    def start_ns(self) -> int:
        """The beginning of the timeline `elapsed`: the first message's time."""
        return self._canvas.start_ns or 0

    def flush(self) -> None:
        """Sends what was gathered; call it now and then while a session runs, and at the end."""
        self._canvas.flush()
