"""Simulates many runs at once: each rests until the onset, slides until the stop, and again, until its commands end."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from station.physics.contact import Array
from station.physics.model import Model
from station.simulators.planar.commands import Commands
from station.simulators.planar.friction import LimitCurve
from station.simulators.planar.load import World
from station.simulators.planar.path import Path
from station.simulators.planar.plate import Index
from station.simulators.planar.rest import Lying, Rest
from station.simulators.planar.slide import Nodes, Slide, Stop

CHUNK = 8192
"""Runs that are followed together: with fewer the calls cost more, with more the arrays leave the processor's cache."""
_STUTTER_M, _STUCK_S = 1e-6, 1e-3
"""A slip no longer than this is no slip; the next one is not tried earlier than so much later."""
ONSET_M = 2e-5
"""A slip no longer than this, a tenth of a pixel, is no onset: jerks move a block by some micrometres."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Chances:
    """The random differences between runs.

    Attributes:
        friction: (n,) factor on the friction, lognormal with the median 1 and the model's scatter.
        shake: (n,) standard normal: the share of `Model.shaking` that acts along the slope, on a block at rest; a
            positive one, which lets it slip early, also during the slide.
    """

    friction: Array
    shake: Array

    @classmethod
    def none(cls, n: int) -> Chances:
        """Returns no random differences."""
        return cls(friction=np.ones(n), shake=np.zeros(n))

    def rows(self, chosen: slice) -> Chances:
        """Returns the differences of the chosen runs."""
        return Chances(friction=self.friction[chosen], shake=self.shake[chosen])

    @classmethod
    def drawn(cls, n: int, *, scatter: float, rng: np.random.Generator) -> Chances:
        """Draws them for n runs."""
        friction, shake = rng.standard_normal((2, n))
        return cls(friction=np.exp(scatter * friction), shake=shake)


@dataclass(frozen=True, eq=False, kw_only=True)
class Motions:
    """The motions of n blocks.

    Attributes:
        onset_s: (n,) the true time of the first onset from rest of a slip beyond `ONSET_M`; nan without one.
        onset_rad: (n,) the tilt at which a plate at rest would have let go, by what the arm reports at the time
            that the camera gives that onset.
        way_rad: (n,) direction in P of the first motion; nan without one.
        slip_end_s: (n,) when the first slide ended.
        pose: (n, 3) x, y (m), yaw (rad) at the end.
        time_s: (n, m) stamps of `path`.
        path: (n, m, 3) x, y (m) and yaw (rad) that the camera would stamp so.
    """

    onset_s: Array
    onset_rad: Array
    way_rad: Array
    slip_end_s: Array
    pose: Array
    time_s: Array
    path: Array

    def __len__(self) -> int:
        return len(self.onset_s)


_FIELDS = tuple(spec.name for spec in fields(Motions))


def simulate(
    commands: Commands, model: Model, *, time_s: ArrayLike | None = None, chances: Chances | None = None
) -> Motions:
    """Follows every run of `commands` to its end.

    Args:
        commands: what the runs are told.
        model: friction and effects; a camera's delay shifts the path against the stamps.
        time_s: stamps (m,) or (n, m), ascending, at which the path is wanted; none by default.
        chances: what differs by chance; nothing by default.
    """
    n = len(commands)
    stamps = np.empty((n, 0)) if time_s is None else np.asarray(time_s, dtype=float)
    stamps = np.broadcast_to(stamps, (n, stamps.shape[-1]))
    chances = chances or Chances.none(n)
    curve = LimitCurve(model)
    parts = [
        _chunk(commands.rows(rows), model, curve, stamps=stamps[rows], chances=chances.rows(rows))
        for rows in (slice(k, k + CHUNK) for k in range(0, n, CHUNK))
    ]
    joined = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _FIELDS}
    return Motions(**joined)


def _chunk(
    commands: Commands, model: Model, curve: LimitCurve, *, stamps: Array, chances: Chances
) -> Motions:  # fmt: skip
    delay_s = model.delay_s()
    world = World(commands, model, friction=chances.friction, shake=chances.shake)
    path = Path(commands.start, stamps - delay_s)
    batch = _Batch(world, curve, path)
    batch.run()
    return Motions(
        onset_s=batch.onset_s,
        onset_rad=commands.resting_tilt_at(batch.onset_s + delay_s),
        way_rad=batch.way_rad,
        slip_end_s=batch.slip_end_s,
        pose=batch.pose,
        time_s=stamps,
        path=path.pose,
    )


class _Batch:
    """Some runs in progress, round after round."""

    def __init__(self, world: World, curve: LimitCurve, path: Path) -> None:
        n = len(world.commands)
        self._world, self._path = world, path
        self._rest, self._slide = Rest(world, curve), Slide(world, curve, traced=path.wanted)
        self.onset_s, self.way_rad, self.slip_end_s = (np.full(n, np.nan) for _ in range(3))
        self.pose = world.commands.start.copy()
        self._rest_from_s = world.commands.rest_from_s
        self._now_s = world.commands.time_s[:, 0].copy()
        self._number = np.zeros(n, dtype=np.intp)

    def run(self) -> None:
        """Follows all runs to their ends."""
        left = self._pushed_off()
        while len(left):
            left = self._round(left)

    def _pushed_off(self) -> Index:
        """Lets those slide that move from the beginning; gives the runs that go on, which are all the others too."""
        commands = self._world.commands
        speed = np.hypot(commands.velocity[:, 0], commands.velocity[:, 1])
        row = np.flatnonzero(speed > 0)
        if not len(row):
            return np.arange(len(speed))
        time_s, way = self._now_s[row], np.arctan2(commands.velocity[row, 1], commands.velocity[row, 0])
        blocks = self._world.blocks(
            row, self._number[row], rest_from_s=self._rest_from_s[row], slid_from_s=time_s - commands.slid_s[row]
        )
        nodes, stop = self._slide.run(
            blocks, time_s, self.pose[row], way=way, speed=speed[row], yaw_rate=commands.velocity[row, 2]
        )
        self._path.slide(nodes, stop)
        self._settle(stop, np.full(len(stop.row), True))
        return np.flatnonzero(self._now_s < commands.end_s)

    def _settle(self, stop: Stop, moved: NDArray[np.bool_]) -> None:
        """Lets the blocks lie where they stopped, afresh if they have moved."""
        self.pose[stop.row], self._number[stop.row] = stop.pose, stop.number
        self._now_s[stop.row] = np.where(moved, stop.time_s, stop.time_s + _STUCK_S)
        self._rest_from_s[stop.row[moved]] = stop.time_s[moved]

    def _round(self, row: Index) -> Index:
        """Follows one rest and one slide of the runs `row`; returns those that go on."""
        lying = Lying(row, self._number[row], self._now_s[row], self._rest_from_s[row], self.pose[row])
        onset, creep = self._rest.crossing(lying)
        self.pose[row] = onset.pose
        if creep is not None:
            self._path.creep(row, creep, np.minimum(onset.time_s, self._world.commands.end_s[row]))
        slips = np.flatnonzero(onset.time_s < self._world.commands.end_s[row])
        if not len(slips):
            return row[:0]
        row, time_s, way = row[slips], onset.time_s[slips], onset.way[slips]
        blocks = self._world.blocks(row, onset.number[slips], rest_from_s=self._rest_from_s[row], slid_from_s=time_s)
        nodes, stop = self._slide.run(blocks, time_s, onset.pose[slips], way=way)
        self._note(row, time_s, way, nodes, stop)
        return stop.row[stop.time_s < self._world.commands.end_s[stop.row]]

    def _note(self, row: Index, time_s: Array, way: Array, nodes: Nodes, stop: Stop) -> None:
        began = np.full(len(self.pose), np.nan)
        began[row] = time_s
        length = np.linalg.norm(stop.pose[:, :2] - self.pose[stop.row, :2], axis=1)
        moved = length > _STUTTER_M
        self._path.slide(nodes, stop)
        self._settle(stop, moved)
        self._rest.beware(stop.row[~moved])
        first = (length > ONSET_M) & np.isnan(self.onset_s[stop.row])
        chosen = stop.row[first]
        ways = np.full(len(self.pose), np.nan)
        ways[row] = way
        self.onset_s[chosen], self.slip_end_s[chosen] = began[chosen], stop.time_s[first]
        self.way_rad[chosen] = ways[chosen]
