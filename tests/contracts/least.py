"""Messages with as little in them as there can be: without a byte a payload is no message of a topic."""

from __future__ import annotations

import dataclasses
from typing import Any

from shared import topics
from shared.foxglove import FrameTransform, FrameTransforms, Timestamp
from shared.messages import JointState, JointTarget, MarkerCorners, Message, Sample

_LEAST: dict[type[Message], Message] = {
    Sample: Sample(run=1),
    JointState: JointState(position_rad=(0.0,)),
    JointTarget: JointTarget(position_rad=(0.0,), velocity_rad_s=(0.0,)),
    FrameTransforms: FrameTransforms((FrameTransform(),)),
    MarkerCorners: MarkerCorners(capture_ns=1),
}


def least(name: str) -> Message:
    """Returns a message of a topic with as little in it as there can be: a time alone will do for most."""
    cls = topics.topic(name).message
    if cls in _LEAST:
        return _LEAST[cls]
    fields = {spec.name for spec in dataclasses.fields(cls)}
    made: Any = cls
    return made(stamp_ns=1) if "stamp_ns" in fields else made(timestamp=Timestamp(1))
