"""Draws what the session does: the phases as lanes, the log, and the table of its runs."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping

import rerun as rr

from shared.foxglove import LEVELS, Log
from shared.messages import REPLACED, ArmReply, Heartbeat, MotionReport, RunEvent, Sample
from station.pages.markdown import row
from station.recording.summary import degrees, sd_degrees
from station.view import colours, entities
from station.view.canvas import Canvas, named
from station.view.part import Handler, Rates
from station.view.setup import Setup

_RUNS_SHOWN = 18
_LEVEL_NAMES = {
    number: {"warning": "WARN", "fatal": "CRITICAL"}.get(name, name.upper()) for name, number in LEVELS.items()
}


class StatePart:
    """Lanes of what was going on: the run's phase, the arm's motion, whether the station is armed."""

    def __init__(self, canvas: Canvas, setup: Setup, rates: Rates) -> None:
        del setup, rates
        self._canvas = canvas
        self._armed: bool | None = None
        for path, states in (
            (entities.PHASE, colours.PHASES),
            (entities.MOTION, colours.MOTION),
            (entities.STATION, colours.STATION),
        ):
            canvas.static(path, rr.StateConfiguration(values=list(states), colors=list(states.values())))

    def handlers(self) -> Mapping[str, Handler]:
        """Returns the handlers of phases, motions and the station's heartbeat."""
        return {
            "session/event": self._on_event,
            "arm/motion": self._on_motion,
            "session/heartbeat": self._on_heartbeat,
        }

    def _on_event(self, event: RunEvent) -> None:
        if event.phase in colours.PHASES:
            self._canvas.log(entities.PHASE, rr.StateChange(state=event.phase))
        elif event.phase in ("STEP_BEGIN", "STEP_END"):
            state = "moving" if event.phase == "STEP_BEGIN" else "holding"
            self._canvas.log(entities.MOTION, rr.StateChange(state=state))

    def _on_motion(self, report: MotionReport) -> None:
        state = "fault" if _failed(report) else "holding" if report.end_ns else "moving"
        self._canvas.log(entities.MOTION, rr.StateChange(state=state))

    def _on_heartbeat(self, heartbeat: Heartbeat) -> None:
        if heartbeat.armed != self._armed:
            self._armed = heartbeat.armed
            self._canvas.log(entities.STATION, rr.StateChange(state="armed" if heartbeat.armed else "not armed"))


class LogPart:
    """Every line of every process's log, and what went wrong in a run or a motion."""

    def __init__(self, canvas: Canvas, setup: Setup, rates: Rates) -> None:
        del setup, rates
        self._canvas = canvas

    def handlers(self) -> Mapping[str, Handler]:
        """Returns the handlers of log lines, phases, motions and replies of the arm."""
        return {
            "log": self._on_log,
            "session/event": self._on_event,
            "arm/motion": self._on_motion,
            "arm/reply": self._on_reply,
        }

    def _on_log(self, line: Log) -> None:
        who = line.name or "unnamed"
        text = rr.TextLog(f"{who}: {line.message}", level=_LEVEL_NAMES.get(line.level, "INFO"))
        self._canvas.log(named(entities.LOG, who), text)

    def _on_event(self, event: RunEvent) -> None:
        if event.reason:
            level = "WARN" if event.phase == "ABORTED" else "INFO"
            text = f"run {event.run}, {event.phase}: {event.reason}"
            self._canvas.log(entities.EVENTS, rr.TextLog(text, level=level))

    def _on_reply(self, reply: ArmReply) -> None:
        if not reply.accepted:
            self._canvas.log(entities.EVENTS, rr.TextLog(f"the arm refused: {reply.reason}", level="WARN"))

    def _on_motion(self, report: MotionReport) -> None:
        if _failed(report):
            self._canvas.log(entities.EVENTS, rr.TextLog(f"run {report.run}, arm: {report.fault}", level="ERROR"))


class SamplesPart:
    """The runs so far as a table, the last ones in full, and mean ± sd of each direction."""

    def __init__(self, canvas: Canvas, setup: Setup, rates: Rates) -> None:
        del setup, rates
        self._canvas = canvas
        self._rows: deque[str] = deque(maxlen=_RUNS_SHOWN)
        self._directions: dict[int, _Spread] = {}
        self._present: tuple[int, str] | None = None
        self._present_ns = 0

    def handlers(self) -> Mapping[str, Handler]:
        """Returns the handlers of phases and samples."""
        return {"session/event": self._on_event, "session/sample": self._on_sample}

    def _on_event(self, event: RunEvent) -> None:
        if self._present != (event.run, event.phase) and event.phase in colours.PHASES:
            self._present = (event.run, event.phase)
            self._present_ns = self._canvas.now_ns
            self._show()

    def _on_sample(self, sample: Sample) -> None:
        self._rows.appendleft(_row(sample))
        if not sample.censored and not sample.flags:
            spread = self._directions.setdefault(sample.direction, _Spread())
            spread.add(math.degrees(sample.onset_angle_rad))
        # A sample is stamped with the slip's detection, but known only later, after the phases that follow.
        sample_ns = self._canvas.now_ns
        self._canvas.at(max(sample_ns, self._present_ns))
        self._show()
        self._canvas.at(sample_ns)

    def _show(self) -> None:
        present = "run {}: {}".format(*self._present) if self._present else "not begun"
        head = f"## {present}\n\n| run | direction | onset | remarks |\n|---:|---:|---:|---|\n"
        table = head + "\n".join(self._rows)
        means = "".join(
            f"| {_direction(number)} | {spread.count} | {spread.text()} |\n"
            for number, spread in sorted(self._directions.items())
        )
        summary = f"\n\n| direction | kept samples | mean ± sd |\n|---:|---:|---:|\n{means}" if means else ""
        self._canvas.log(entities.SAMPLES, rr.TextDocument(table + summary, media_type=rr.MediaType.MARKDOWN))


class _Spread:
    """Mean and standard deviation as they come (Welford 1962)."""

    def __init__(self) -> None:
        self.count, self.mean, self._squares = 0, 0.0, 0.0

    def add(self, value: float) -> None:
        self.count += 1
        step = value - self.mean
        self.mean += step / self.count
        self._squares += step * (value - self.mean)

    def text(self) -> str:
        spread = f" ± {math.sqrt(self._squares / (self.count - 1)):.2f}" if self.count > 1 else ""
        return f"{self.mean:.2f}{spread}°"


def _row(sample: Sample) -> str:
    error = f" ± {sd_degrees(sample.onset_sigma_rad)}" if sample.onset_sigma_rad > 0 else ""
    onset = f"{degrees(sample.onset_angle_rad)}{error}°"
    if sample.censored:
        onset = f"none up to {degrees(sample.onset_angle_rad)}°"
    return row((str(sample.run), _direction(sample.direction), onset, ", ".join(sample.flags)))


def _direction(number: int) -> str:
    return "free" if number < 0 else str(number)


def _failed(report: MotionReport) -> bool:
    """Returns true if a motion failed; one that a return took over did not."""
    return bool(report.fault) and report.fault != REPLACED
