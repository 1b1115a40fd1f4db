"""Draws the rig's health: frame rate, dropped frames, clocks, air."""

from __future__ import annotations

from collections.abc import Mapping

import rerun as rr

from shared.messages import AgentStatus, ClockOffset, Environment
from station.view import colours, entities
from station.view.canvas import Canvas, named
from station.view.part import Handler, Rates
from station.view.setup import Setup


class HealthPart:
    """Slow curves; a fault of the camera agent becomes a line of the log."""

    def __init__(self, canvas: Canvas, setup: Setup, rates: Rates) -> None:
        del setup, rates
        self._canvas = canvas
        self._fault = ""
        self._clocks: set[str] = set()
        names = {
            entities.CAMERA_RATE: "camera (frames/s)",
            entities.CAMERA_DROPPED: "dropped frames",
            entities.TEMPERATURE: "air (°C)",
            entities.HUMIDITY: "relative humidity (%)",
        }
        for (path, name), colour in zip(names.items(), colours.CORNERS, strict=True):
            canvas.name_curves(path, [name], [colour])

    def handlers(self) -> Mapping[str, Handler]:
        """Returns the handlers of the camera's state, the clocks and the air."""
        return {"camera/status": self._on_status, "clock": self._on_clock, "environment": self._on_environment}

    def _on_status(self, status: AgentStatus) -> None:
        self._canvas.curve(entities.CAMERA_RATE, status.rate_hz)
        self._canvas.curve(entities.CAMERA_DROPPED, status.dropped)
        if status.fault != self._fault:
            self._fault = status.fault
            level, text = ("ERROR", status.fault) if status.fault else ("INFO", "the camera works again")
            self._canvas.log(entities.EVENTS, rr.TextLog(f"camera: {text}", level=level))

    def _on_clock(self, offset: ClockOffset) -> None:
        path = named(entities.CLOCK, offset.agent)
        if path not in self._clocks:
            self._clocks.add(path)
            shade = colours.CORNERS[len(self._clocks) % len(colours.CORNERS)]
            self._canvas.name_curves(path, [f"{offset.agent} clock offset (ms)"], [shade])
        self._canvas.curve(path, 1e-6 * offset.offset_ns)

    def _on_environment(self, air: Environment) -> None:
        self._canvas.curve(entities.TEMPERATURE, air.temperature_c)
        self._canvas.curve(entities.HUMIDITY, 100.0 * air.relative_humidity)
