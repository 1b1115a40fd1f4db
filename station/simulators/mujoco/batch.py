"""Many runs in MuJoCo, each stepped only around its slides.

While a block needs less than `SHARE` of its friction it lies still, and no time is spent on it: the moment at which the
load passes that share is found as the planar simulator finds an onset. From there on it is MuJoCo that holds the block,
lets it go and stops it, until it lies well below the limit again. A test compares this with stepping through it all.
"""

from __future__ import annotations

import itertools
from dataclasses import fields, replace

import numpy as np
from numpy.typing import ArrayLike

from station.physics.contact import Array
from station.physics.model import Model
from station.simulators.mujoco.following import QUIET_S, SLIP_M, STOPS_M_S, Followed, Follower, TimedPoses
from station.simulators.mujoco.tilted import Plate, Setup, TiltedBlock
from station.simulators.planar.commands import Commands
from station.simulators.planar.friction import LimitCurve
from station.simulators.planar.load import FOAM_DAMPING, FOAM_N_M, World
from station.simulators.planar.plate import Index
from station.simulators.planar.rest import Lying, Rest
from station.simulators.planar.simulate import ONSET_M, Chances, Motions

SHARE = 0.95
SHARE_CREEPING = 0.5
"""The share from which on every step is taken where settings let a block creep; creep below it is left out."""
CHUNK = 256
"""The number of runs that are followed together: each has a block of its own in memory."""
_FOAM_STEP = 0.5
"""The longest step against a light block's damping in the foam."""
_FIELDS = tuple(spec.name for spec in fields(Motions))


def simulate(
    commands: Commands,
    model: Model,
    *,
    time_s: ArrayLike | None = None,
    chances: Chances | None = None,
    setup: Setup | None = None,
    share: float = SHARE,
) -> Motions:
    """Follows every run of `commands` to its end; as `planar.simulate.simulate`, with MuJoCo's contact.

    Args:
        commands: what the runs are told.
        model: friction and effects.
        time_s: stamps (m,) or (n, m) at which the path is wanted; none by default.
        chances: what differs by chance; nothing by default.
        setup: MuJoCo's settings; those that hold a block rightly by default.
        share: of its friction, below which a block is taken to lie still; 0: every step is taken.
    """
    n = len(commands)
    stamps = np.empty((n, 0)) if time_s is None else np.asarray(time_s, dtype=float)
    stamps = np.broadcast_to(stamps, (n, stamps.shape[-1]))
    chances = chances or Chances.none(n)
    parts = list[Motions]()
    for rows in (slice(k, k + CHUNK) for k in range(0, n, CHUNK)):
        batch = _Batch(commands.rows(rows), model, chances.rows(rows), setup or Setup(), share)
        batch.run()
        parts.append(batch.motions(stamps[rows]))
    return Motions(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in _FIELDS})


class _Batch:
    """Some runs in progress."""

    def __init__(self, commands: Commands, model: Model, chances: Chances, setup: Setup, share: float) -> None:
        self._commands, self._model, self._share = commands, model, share
        curve = LimitCurve(model)
        self._world = World(commands, model, friction=chances.friction, shake=chances.shake)
        careful = World(commands, model, friction=max(share, 1e-6) * chances.friction, shake=chances.shake)
        self._rest, self._follower = Rest(careful, curve), Follower(self._world, curve)
        n = len(commands)
        self._onset_s, self._slip_end_s, self._way = (np.full(n, np.nan) for _ in range(3))
        self._bodies, self._step_s = _bodies(commands, setup)
        self._pose = commands.start.copy()
        self._rest_from_s = commands.rest_from_s
        self._seen: list[TimedPoses] = [TimedPoses(np.arange(n), commands.time_s[:, 0], commands.start.copy())]
        self._quiet_s = np.zeros(n)

    def run(self) -> None:
        """Follows all runs to their ends."""
        commands = self._commands
        everyone, first = np.arange(len(commands)), commands.time_s[:, 0].copy()
        sliding = np.hypot(commands.velocity[:, 0], commands.velocity[:, 1]) > 0
        number = np.zeros(len(commands), dtype=np.intp)
        way = np.arctan2(commands.velocity[sliding, 1], commands.velocity[sliding, 0])
        runs = self._begun(everyone[sliding], first[sliding], number[sliding], way, commands.velocity[sliding])
        runs.slid_from_s[:] = runs.time_s - commands.slid_s[sliding]
        runs = _joined(runs, self._woken(everyone[~sliding], first[~sliding], number[~sliding]))
        while len(runs.row):
            surplus = self._follower.step(runs)
            self._seen.append(TimedPoses(runs.row, runs.time_s, runs.pose))
            runs = self._sorted_out(runs, surplus)

    def _woken(self, row: Index, from_s: Array, number: Index) -> Followed:
        """Returns the lying runs of `row` that come near their limit, at the moment at which they do."""
        if not len(row):
            return self._begun(row, from_s, number, from_s, np.zeros((0, 3)))
        lying = Lying(row, number, from_s, self._rest_from_s[row], self._pose[row])
        near, creep = self._rest.crossing(lying)
        ends = self._commands.end_s[row]
        if creep is not None:
            for node in range(creep.time_s.shape[1]):
                before = creep.time_s[:, node] < np.minimum(near.time_s, ends)
                pose = np.column_stack([creep.position[:, node], lying.pose[:, 2]])
                self._seen.append(TimedPoses(row[before], creep.time_s[before, node], pose[before]))
        self._pose[row] = near.pose
        self._seen.append(TimedPoses(row, np.minimum(near.time_s, ends), near.pose.copy()))
        woken = near.time_s < ends
        found = row[woken]
        return self._begun(found, near.time_s[woken], near.number[woken], near.way[woken], np.zeros((len(found), 3)))

    def _begun(self, row: Index, time_s: Array, number: Index, way: Array, rates: Array) -> Followed:
        """Lays the blocks of these runs down, and returns the runs to be stepped from now on."""
        tilt = self._commands.tilt_at(np.zeros(len(self._commands)))
        tilt[row] = self._commands.tilt_at(_spread(time_s, row, len(self._commands)))[row]
        bodies = [self._bodies[number] for number in row.tolist()]
        for body, pose, velocity, cosine in zip(bodies, self._pose[row], rates, np.cos(tilt[row]), strict=True):
            body.lay(pose, velocity=velocity, normal_m_s2=9.81 * float(cosine))
        self._quiet_s[row] = 0.0
        return Followed(
            row=row,
            number=number.copy(),
            time_s=time_s.copy(),
            step_s=self._step_s[row],
            pose=self._pose[row],
            rates=rates.copy(),
            way=way.copy(),
            slid_from_s=np.full(len(row), np.inf),
            rest_from_s=self._rest_from_s[row],
            since_s=np.zeros(len(row)),
            surplus=np.full(len(row), np.nan),
            over_from_s=np.full(len(row), np.inf),
            from_position=self._pose[row, :2],
            bodies=bodies,
        )

    def _sorted_out(self, runs: Followed, surplus: Array) -> Followed:
        """Notes the slides that end, and releases the runs that are over or lie well."""
        speed = np.hypot(runs.rates[:, 0], runs.rates[:, 1])
        slid = np.linalg.norm(runs.pose[:, :2] - runs.from_position, axis=1)
        self._note_onsets(runs, runs.moving & (slid > ONSET_M))
        stopped = runs.moving & (speed < STOPS_M_S) & (surplus > 0)
        amid = runs.slid_from_s < self._commands.time_s[runs.row, 0]  # it has slid before it was laid down here
        afresh = stopped & (amid | (slid > SLIP_M))
        ended = afresh & np.isnan(self._slip_end_s[runs.row]) & ~np.isnan(self._onset_s[runs.row])
        self._slip_end_s[runs.row[ended]] = runs.time_s[ended]
        runs.rest_from_s[afresh] = self._rest_from_s[runs.row[afresh]] = runs.time_s[afresh]
        runs.slid_from_s[stopped] = np.inf
        quiet = self._quiet_s[runs.row] + runs.step_s
        self._quiet_s[runs.row] = np.where(runs.moving | (surplus < 1.0 - self._share), 0.0, quiet)
        over = runs.time_s >= self._commands.end_s[runs.row]
        still = ~over & (self._quiet_s[runs.row] >= QUIET_S)
        gone = over | still
        if not gone.any():
            return runs
        self._pose[runs.row[gone]] = runs.pose[gone]
        row, time_s, number = runs.row[still], runs.time_s[still], runs.number[still]
        return _joined(runs.select(np.flatnonzero(~gone)), self._woken(row, time_s, number))

    def _note_onsets(self, runs: Followed, chosen: Array) -> None:
        first = chosen & np.isnan(self._onset_s[runs.row]) & ~(self._commands.velocity[runs.row, :2] != 0).any(axis=1)
        row = runs.row[first]
        self._onset_s[row] = runs.slid_from_s[first]
        moved = runs.pose[first, :2] - runs.from_position[first]
        self._way[row] = np.arctan2(moved[:, 1], moved[:, 0])

    def motions(self, stamps: Array) -> Motions:
        """Returns the resulting motions, at stamps (n, m), s."""
        delay_s = self._model.delay_s()
        return Motions(
            onset_s=self._onset_s,
            onset_rad=self._commands.resting_tilt_at(self._onset_s + delay_s),
            way_rad=self._way,
            slip_end_s=self._slip_end_s,
            pose=self._pose,
            time_s=stamps,
            path=self._path(stamps - delay_s),
        )

    def _path(self, stamps: Array) -> Array:
        row, time_s, pose = (np.concatenate(parts) for parts in zip(*self._seen, strict=True))
        order = np.lexsort((time_s, row))
        bounds = np.searchsorted(row[order], np.arange(len(stamps) + 1))
        path = np.empty((*stamps.shape, 3))
        for run, (first, last) in enumerate(itertools.pairwise(bounds.tolist())):
            own = order[first:last]
            for axis in range(3):
                path[run, :, axis] = np.interp(stamps[run], time_s[own], pose[own, axis])
        return path


def _bodies(commands: Commands, setup: Setup) -> tuple[list[TiltedBlock], Array]:
    """Returns a block for each run, and its time step; runs with equal blocks share a compiled model."""
    plates, found = dict[tuple[float, float], Plate](), list[TiltedBlock]()
    for mass, area in zip(commands.mass_kg.tolist(), commands.area_m2.tolist(), strict=True):
        if (mass, area) not in plates:
            own = setup
            if commands.opening.walled:
                longest = _FOAM_STEP / (2.0 * FOAM_DAMPING * float(np.sqrt(FOAM_N_M / mass)))
                own = replace(setup, step_s=min(setup.step_s, longest))
            plates[mass, area] = Plate(own, side_m=float(np.sqrt(area)), mass_kg=mass)
        found.append(plates[mass, area].block())
    steps = [plates[key].setup.step_s for key in zip(commands.mass_kg.tolist(), commands.area_m2.tolist(), strict=True)]
    return found, np.array(steps)


def _spread(values: Array, row: Index, n: int) -> Array:
    everywhere = np.zeros(n)
    everywhere[row] = values
    return everywhere


def _joined(first: Followed, second: Followed) -> Followed:
    """Returns the motions of two batches as one, the first one's runs first."""
    if not len(second.row):
        return first
    names = [spec.name for spec in fields(Followed) if spec.name != "bodies"]
    arrays = {name: np.concatenate([getattr(first, name), getattr(second, name)]) for name in names}
    return Followed(**arrays, bodies=first.bodies + second.bodies)
