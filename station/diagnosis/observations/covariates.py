"""The covariates that could explain a residual, by the names that reports use."""

from __future__ import annotations

ANGLES = frozenset({"previous_direction", "turned", "direction", "yaw", "slide_to_block", "slide_to_grain"})
"""Covariates that are angles, on which a residual depends periodically."""

PLACES = ("x", "y")
"""The two covariates of the place on the plate, which belong together."""

KIND = "kind"
"""The covariate that nobody recorded: which of two kinds a run is of, see `search/kinds.py`."""

TITLES = {
    "direction": "tilt direction",
    "yaw": "block's yaw",
    "slide_to_block": "direction against the block",
    "slide_to_grain": "direction against the plate's texture",
    "position": "place on the plate",
    "ahead": "place along the slide's direction",
    "previous_direction": "direction of the run before",
    "turned": "direction against that of the run before",
    "previous_slide": "length of the slide before",
    "since_handled": "runs since the block was put back",
    "speed": "speed",
    "slide_time": "time since the onset",
    "tilt": "tilt",
    "tilt_rate": "tilt rate",
    "dwell": "time at rest",
    "run": "order of measuring",
    "load": "load",
    "settled": "slip since the speed changed",
    "temperature": "temperature",
    "humidity": "relative humidity",
    "rising": "tilt growing or falling",
}
