"""A recording and simulations of it in one picture: the recorded block, a ghost for each simulation, marked stretches.

Plain data in: whoever simulates and diagnoses says with arrays and words what is to be seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from shared.geometry import Array
from station.view import colours, entities
from station.view.canvas import named
from station.view.entities import ELAPSED, TIME
from station.view.setup import Setup

Times = NDArray[np.int64]
_LIFT_M = 1e-3
_STEP_M = 2e-4
_DIFFERS, _QUIET = "differs", "quiet"


@dataclass(frozen=True, eq=False, kw_only=True)
class Path:
    """The path of a block: `time_ns` (n,) on the recording's clock, `pose` (n, 3) x, y (m), yaw (rad) on the plate."""

    time_ns: Times
    pose: Array

    def between(self, from_ns: int, to_ns: int) -> Array:
        """Returns the poses (k, 3), m and rad, with from_ns ≤ time ≤ to_ns."""
        first, last = np.searchsorted(self.time_ns, [from_ns, to_ns + 1])
        return self.pose[first:last]


@dataclass(frozen=True, eq=False, kw_only=True)
class Ghost:
    """A simulated block beside the recorded one; `name` is a word, such as `before`."""

    name: str
    path: Path
    colour: colours.Colour


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """A stretch of the recording to be marked: in which run, from when to when, in which phase, and why."""

    run: int
    from_ns: int
    to_ns: int
    phase: str
    why: str


@dataclass(frozen=True, eq=False, kw_only=True)
class Overlay:
    """An overlay over a session. `words` is a text in Markdown; `runs` are the runs' first and last moments."""

    recorded: Path
    ghosts: tuple[Ghost, ...] = ()
    stretches: tuple[Stretch, ...] = ()
    runs: tuple[tuple[int, int], ...] = ()
    words: str = ""

    @property
    def phases(self) -> tuple[str, ...]:
        """The phases of the stretches, each once."""
        return tuple(dict.fromkeys(stretch.phase for stretch in self.stretches))


def draw_overlay(recording: rr.RecordingStream, overlay: Overlay, *, setup: Setup, start_ns: int) -> None:
    """Logs it all; `start_ns` is where the timeline `elapsed` begins."""
    clock = _Clock(recording, start_ns)
    for ghost in overlay.ghosts:
        _draw_ghost(clock, ghost, overlay, setup=setup)
    _draw_lanes(clock, overlay)
    _draw_places(clock, overlay)
    _list(clock, overlay.stretches)
    if overlay.words:
        text = rr.TextDocument(overlay.words, media_type=rr.MediaType.MARKDOWN)
        recording.log(entities.DIAGNOSIS, text, static=True)


class _Clock:
    """Logs at moments, on both timelines."""

    def __init__(self, recording: rr.RecordingStream, start_ns: int) -> None:
        self.recording, self._start_ns = recording, start_ns

    def log(self, at_ns: int, entity: str, archetype: rr.AsComponents) -> None:
        """Logs one thing at one moment."""
        self.recording.set_time(TIME, timestamp=np.datetime64(at_ns, "ns"))
        self.recording.set_time(ELAPSED, duration=np.timedelta64(at_ns - self._start_ns, "ns"))
        self.recording.log(entity, archetype)

    def columns(self, times_ns: Times) -> list[rr.TimeColumn]:
        """Returns the moments of a batch."""
        return [
            rr.TimeColumn(TIME, timestamp=times_ns.astype("datetime64[ns]")),
            rr.TimeColumn(ELAPSED, duration=(times_ns - self._start_ns).astype("timedelta64[ns]")),
        ]


def _draw_ghost(clock: _Clock, ghost: Ghost, overlay: Overlay, *, setup: Setup) -> None:
    """Draws a block of wires that moves with the plate, its whole way in each run, and how far it has slid."""
    times_ns, pose = _thinned(ghost.path)
    if not len(times_ns):
        return
    body, trail = f"{entities.GHOSTS}{ghost.name}/block", f"{entities.GHOSTS}{ghost.name}/way"
    shape = rr.Boxes3D(
        half_sizes=[[0.5 * size for size in setup.block_size_m]],
        colors=[ghost.colour],
        fill_mode="majorwireframe",
    )
    clock.recording.log(body, shape, static=True)
    height = np.full(len(pose), 0.5 * setup.block_size_m[2])
    half = 0.5 * pose[:, 2]
    turn = np.column_stack([np.zeros(len(pose)), np.zeros(len(pose)), np.sin(half), np.cos(half)])
    clock.recording.send_columns(
        body,
        indexes=clock.columns(times_ns),
        columns=rr.Transform3D.columns(translation=np.column_stack([pose[:, :2], height]), quaternion=turn),
    )
    slid = np.full(len(times_ns), np.nan)
    for from_ns, to_ns in overlay.runs:
        first, last = np.searchsorted(times_ns, [from_ns, to_ns + 1])
        if last - first > 1:
            own = pose[first:last, :2]
            slid[first:last] = 1e3 * np.hypot(*(own - own[0]).T)
            strip = np.column_stack([own, np.full(len(own), _LIFT_M)])
            clock.log(from_ns, trail, rr.LineStrips3D([strip], colors=[ghost.colour], radii=[colours.LINE]))
    curve = entities.SLID_GHOSTS + ghost.name
    look = rr.SeriesLines(names=[f"{ghost.name}: slid (mm)"], colors=[ghost.colour], widths=[1.5])
    clock.recording.log(curve, look, static=True)
    clock.recording.send_columns(curve, indexes=clock.columns(times_ns), columns=rr.Scalars.columns(scalars=slid))


def _thinned(path: Path) -> tuple[Times, Array]:
    """Leaves out the frames in which nothing moves: a change keeps its frame and the one before it."""
    if len(path.time_ns) < 2:
        return path.time_ns, path.pose
    moved = np.abs(np.diff(path.pose, axis=0)).max(axis=1) > 1e-7
    keep = np.ones(len(path.time_ns), dtype=np.bool_)
    keep[1:-1] = moved[:-1] | moved[1:]
    return path.time_ns[keep], path.pose[keep]


def _draw_lanes(clock: _Clock, overlay: Overlay) -> None:
    """Draws a lane of the state timeline for each phase of a run that has stretches: marked where something stands out.

    A lane for each thing that stands out would push the run's own lane out of the panel; the log tells them apart.
    """
    for phase in overlay.phases:
        entity = named(entities.LOCATED, phase)
        shades = [colours.LOCATED, colours.QUIET]
        clock.recording.log(entity, rr.StateConfiguration(values=[_DIFFERS, _QUIET], colors=shades), static=True)
        own = [(one.from_ns, one.to_ns) for one in overlay.stretches if one.phase == phase]
        for from_ns, to_ns in joined(own):
            clock.log(from_ns, entity, rr.StateChange(state=_DIFFERS))
            clock.log(max(to_ns, from_ns + 1), entity, rr.StateChange(state=_QUIET))


def joined(stretches: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
    """Returns stretches in order of time; those that overlap are one."""
    found: list[tuple[int, int]] = []
    for from_ns, to_ns in sorted(stretches):
        if found and from_ns <= found[-1][1]:
            found[-1] = (found[-1][0], max(found[-1][1], to_ns))
        else:
            found.append((from_ns, to_ns))
    return found


def _draw_places(clock: _Clock, overlay: Overlay) -> None:
    """Marks on the plate where the recorded block was in each stretch; cleared when the stretch is over."""
    for from_ns, to_ns in joined([(one.from_ns, one.to_ns) for one in overlay.stretches]):
        pose = overlay.recorded.between(from_ns, to_ns)
        if not len(pose):
            continue
        way = np.column_stack([pose[:, :2], np.full(len(pose), 2 * _LIFT_M)])
        steps = np.r_[True, np.hypot(*np.diff(way[:, :2], axis=0).T) > _STEP_M]
        dots = rr.Points3D(way[steps], colors=[colours.LOCATED], radii=[colours.DOT])
        clock.log(from_ns, entities.LOCATED_PLACE, dots)
        clock.log(max(to_ns, from_ns + 1), entities.LOCATED_PLACE, rr.Clear(recursive=False))


def _list(clock: _Clock, stretches: Sequence[Stretch]) -> None:
    for one in sorted(stretches, key=lambda stretch: stretch.from_ns):
        text = f"run {one.run}, {(one.to_ns - one.from_ns) * 1e-9:.2f} s: {one.why}"
        clock.log(one.from_ns, entities.LOCATED_LOG, rr.TextLog(text, level="WARN"))
