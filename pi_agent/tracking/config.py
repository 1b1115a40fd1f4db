"""Holds what a tracker is told before it starts."""

from dataclasses import dataclass, field

from pi_agent.tracking.mark import Mark
from pi_agent.tracking.shutter import Shutter
from pi_agent.tracking.tone import LINEAR, ToneCurve


@dataclass(frozen=True)
class TrackerConfig:
    """Settings of one tracker.

    `mark`: what it looks for; `side_px`: smallest and largest length of the mark's first side in the image; `tone`:
    the camera's curve, undone on the sampled pixels; `shutter`: row times; `region_px`: left, top, width, height of the
    part of the frame that is searched (None: all of it); `blur_px`: deviation of the edge's blur to start from (learned
    from the first frames); `reach_px`: how far from its prediction an edge is searched for.
    """

    mark: Mark = field(default_factory=Mark)
    side_px: tuple[float, float] = (36.0, 150.0)
    tone: ToneCurve = LINEAR
    shutter: Shutter = field(default_factory=Shutter)
    region_px: tuple[int, int, int, int] | None = None
    blur_px: float = 0.9
    reach_px: int = 12
