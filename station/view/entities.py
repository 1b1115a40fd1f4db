"""Names the entities and timelines of the Rerun recording."""

from __future__ import annotations

TIME = "time"
ELAPSED = "elapsed"
"""Timelines: the station's clock, and the time since the first message (what a person reads)."""

WORLD = "world"
ARM = "world/arm"
PLATFORM = "world/platform"
PLATE = "world/platform/plate"
FOAM = "world/platform/foam"
BLOCK = "world/platform/block"
MARK = "world/platform/block/mark"
TRAIL = "world/platform/trail"
DOWNHILL = "world/platform/downhill"
GHOSTS = "world/platform/simulated/"
LOCATED_PLACE = "world/platform/located"

CAMERA = "world/platform/camera"
IMAGE = "world/platform/camera/image"
CORNERS = "world/platform/camera/image/corners"
REFERENCE = "world/platform/camera/image/reference"
WAY = "world/platform/camera/image/way"
PLATE_MARK = "world/platform/camera/image/plate"

TILT = "plots/tilt/measured"
COMMANDED = "plots/tilt/commanded"
ONSET = "plots/tilt/onset"
ANGLES = "plots/tilt/"
DISPLACEMENT = tuple(f"plots/displacement/corner_{number}" for number in range(4))
THRESHOLD = "plots/displacement/threshold"
SLID = "plots/block/slid"
SLID_GHOSTS = "plots/block/simulated/"
HEIGHT = "plots/block/height"

PHASE = "state/run"
MOTION = "state/arm"
STATION = "state/station"
LOCATED = "state/located/"

LOG = "log/"
EVENTS = "log/session"
LOCATED_LOG = "log/diagnosis"
DIAGNOSIS = "diagnosis"
SAMPLES = "samples"

CAMERA_RATE = "health/camera/rate"
CAMERA_DROPPED = "health/camera/dropped"
CLOCK = "health/clock/"
TEMPERATURE = "health/air/temperature"
HUMIDITY = "health/air/humidity"
JOINTS = "health/joints"
