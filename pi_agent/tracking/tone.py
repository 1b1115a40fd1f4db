"""Tone curves: what the camera's processor does to light, and how it is undone on pixels.

A curve that is not straight moves every edge: the Pi's default one shrinks a dark square by 0.4 px at each corner.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_PI_DEFAULT_IN = (
    *range(0, 17 * 1024, 1024),
    *range(18 * 1024, 33 * 1024, 2048),
    *range(36 * 1024, 64 * 1024, 4096),
    65535,
)
_PI_DEFAULT_OUT = (
    *(0, 5040, 9338, 12356, 15312, 18051, 20790, 23193, 25744, 27942, 30035, 32005, 33975, 35815, 37600, 39168, 40642),
    *(43379, 45749, 47753, 49621, 51253, 52698, 53796, 54876),
    *(57012, 58656, 59954, 61183, 62355, 63419, 64476, 65535),
)


@dataclass(frozen=True)
class ToneCurve:
    """A piecewise linear curve from light to pixel value, both scaled to 0…1.

    `light` and `value` are increasing tuples of equal length that start at 0 and end at 1.
    """

    name: str
    light: tuple[float, ...]
    value: tuple[float, ...]

    @property
    def is_linear(self) -> bool:
        """True if pixel values are already proportional to light."""
        return self.light == self.value

    def to_value(self, light: NDArray[np.float32]) -> NDArray[np.float64]:
        """Returns pixel values 0…255 (…,), not rounded, of light 0…1 (…,); light above 1 saturates."""
        return 255.0 * np.interp(light, self.light, self.value)

    def to_light_table(self) -> NDArray[np.float32]:
        """Returns the light of each of the 256 pixel values, scaled so that white stays 255 (shape (256,))."""
        return (255.0 * np.interp(np.arange(256) / 255.0, self.value, self.light)).astype(np.float32)


LINEAR = ToneCurve("linear", (0.0, 1.0), (0.0, 1.0))
"""The curve to ask the camera for: `rpi.contrast` gamma `[0, 0, 65535, 65535]`, `ce_enable` 0, Sharpness 0."""

PI_DEFAULT = ToneCurve(
    "pi-default", tuple(x / 65535.0 for x in _PI_DEFAULT_IN), tuple(y / 65535.0 for y in _PI_DEFAULT_OUT)
)
"""The gamma of libcamera's tuning files for the Pi's sensors (`rpi.contrast` in imx219.json, ov5647.json)."""

TONE_CURVES = {curve.name: curve for curve in (LINEAR, PI_DEFAULT)}
"""The curves by the name that stands in a rig file."""
