"""Renders the camera's picture: exact for tests and benchmarks, fast for the synthetic camera."""

from pi_agent.rendering.exact import ExactRenderer, render
from pi_agent.rendering.fast import FastRenderer
from pi_agent.rendering.marks import Ink, Layer
from pi_agent.rendering.plates import surface
from pi_agent.rendering.scene import (
    Fiducial,
    Glare,
    Optics,
    Pose,
    Scene,
    Sensor,
    Shadow,
    plate_fiducials,
)

__all__ = [
    "ExactRenderer",
    "FastRenderer",
    "Fiducial",
    "Glare",
    "Ink",
    "Layer",
    "Optics",
    "Pose",
    "Scene",
    "Sensor",
    "Shadow",
    "plate_fiducials",
    "render",
    "surface",
]
