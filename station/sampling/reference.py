"""The reference position: mean and noise of the corners over several frames, refused while the noise is too large."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from station.sampling.plan import ReferencePlan


@dataclass(frozen=True, slots=True)
class Reference:
    """Mean corners (x0 y0 … x3 y3, px) and their variances (px², one frame's)."""

    corners_px: tuple[float, ...]
    variance_px2: tuple[float, ...]

    @property
    def centre_px(self) -> tuple[float, float]:
        """Mean of the four corners."""
        return sum(self.corners_px[0::2]) / 4, sum(self.corners_px[1::2]) / 4


class ReferenceReading:
    """Collects frames until they make a reference, or says why they do not."""

    def __init__(self, plan: ReferencePlan) -> None:
        self._plan = plan
        self._frames: list[tuple[float, ...]] = []
        self.refused = 0

    def add(self, corners_px: tuple[float, ...]) -> Reference | str | None:
        """Takes a frame's corners. Gives the reference, a sentence about why this reading was refused, or None yet."""
        self._frames.append(corners_px)
        if len(self._frames) < self._plan.frames:
            return None
        frames, self._frames = np.array(self._frames), []
        variance = frames.var(axis=0, ddof=1)
        noise_px = float(np.sqrt(variance.max()))
        if noise_px > self._plan.noise_limit_px:
            self.refused += 1
            return (
                f"reference refused: the corners scatter by {noise_px:.2f} px, expected at most "
                f"{self._plan.noise_limit_px:g} px; is the block still moving, or the light flickering?"
            )
        return Reference(_floats(frames.mean(axis=0)), _floats(variance))

    @property
    def exhausted(self) -> bool:
        """True if every attempt was refused."""
        return self.refused >= self._plan.attempts


def _floats(values: np.ndarray) -> tuple[float, ...]:
    return tuple(float(value) for value in values)
