"""The curves that decide a run: tilt, and the corners' displacement against the slip threshold."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import rerun as rr

from shared.geometry import tilt_of
from shared.messages import AngleReading, MarkerCorners, PlatformState, Sample, TiltCommand
from shared.topics import ANGLE_PREFIX
from station.view import colours, entities
from station.view.canvas import Canvas, named
from station.view.part import Handler, Rates
from station.view.reference import ReferenceTracker
from station.view.setup import Setup


class TiltPart:
    """Tilt in degrees: measured, commanded, by other sensors, and the onset of each slip as a dot."""

    def __init__(self, canvas: Canvas, setup: Setup, rates: Rates) -> None:
        del setup, rates
        self._canvas = canvas
        self._sources: set[str] = set()
        canvas.name_curves(entities.TILT, ["measured"], [colours.TILT], width=2.0)
        steps = rr.SeriesLines(
            names=["commanded"], colors=[colours.COMMANDED], widths=[1.0], interpolation_mode="StepAfter"
        )
        canvas.static(entities.COMMANDED, steps)
        onset = rr.SeriesPoints(names=["slip onset"], colors=[colours.ONSET], markers=["circle"], marker_sizes=[5.0])
        canvas.static(entities.ONSET, onset)

    def handlers(self) -> Mapping[str, Handler]:
        """Returns the handlers of the measured and the commanded tilt, the samples and all other angle sensors."""
        return {
            "arm/platform": self._on_platform,
            "arm/command": self._on_command,
            "session/sample": self._on_sample,
            ANGLE_PREFIX: self._on_angle,
        }

    def _on_platform(self, state: PlatformState) -> None:
        self._canvas.curve(entities.TILT, math.degrees(tilt_of(state.qw, state.qx, state.qy, state.qz)))

    def _on_command(self, command: TiltCommand) -> None:
        self._canvas.curve(entities.COMMANDED, math.degrees(command.angle_rad))

    def _on_angle(self, reading: AngleReading) -> None:
        path = named(entities.ANGLES, reading.source)
        if path not in self._sources:
            self._sources.add(path)
            shade = colours.CORNERS[len(self._sources) % len(colours.CORNERS)]
            self._canvas.name_curves(path, [reading.source or "unnamed"], [shade])
        self._canvas.curve(path, math.degrees(reading.angle_rad))

    def _on_sample(self, sample: Sample) -> None:
        if sample.censored or not sample.slip_ns:
            return
        now_ns = self._canvas.now_ns
        self._canvas.at(sample.slip_ns)
        self._canvas.curve(entities.ONSET, math.degrees(sample.onset_angle_rad))
        self._canvas.at(now_ns)


class DisplacementPart:
    """The distance (px) of each corner from its reference, and the threshold l = 10 + θ° that it must not pass."""

    def __init__(self, canvas: Canvas, setup: Setup, rates: Rates) -> None:
        del rates
        self._canvas, self._threshold = canvas, setup.threshold
        self._reference = ReferenceTracker()
        self._tilt_deg = 0.0
        self._drawing = False
        for path, colour in zip(entities.DISPLACEMENT, colours.CORNERS, strict=True):
            canvas.name_curves(path, ["moved (px)"], [colour])
        canvas.name_curves(entities.THRESHOLD, ["slip: three above"], [colours.THRESHOLD])

    def handlers(self) -> Mapping[str, Handler]:
        """Returns the handlers of corners, tilt, phases and samples."""
        return {
            "camera/corners": self._on_corners,
            "arm/platform": self._on_platform,
            "session/event": self._reference.on_event,
            "session/sample": self._reference.on_sample,
        }

    def _on_platform(self, state: PlatformState) -> None:
        self._tilt_deg = math.degrees(tilt_of(state.qw, state.qx, state.qy, state.qz))

    def _on_corners(self, corners: MarkerCorners) -> None:
        self._reference.on_corners(corners)
        self._canvas.curve(entities.THRESHOLD, self._threshold.at(self._tilt_deg))
        reference = self._reference.corners_px
        if reference is None or not corners.found:
            self._break()
            return
        self._drawing = True
        moved = np.linalg.norm(np.reshape(corners.corners_px, (4, 2)) - reference, axis=1)
        for path, distance_px in zip(entities.DISPLACEMENT, moved.tolist(), strict=True):
            self._canvas.curve(path, distance_px)

    def _break(self) -> None:
        if self._drawing:
            self._drawing = False
            for path in entities.DISPLACEMENT:
                self._canvas.gap(path)
