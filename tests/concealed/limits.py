"""The detection limit, the unit of strengths, is how strong an effect must be for this very session to show it.

For each run the effect is judged on two statistics that a careful analyst would form. The onset: the logarithm of the
friction that the run needed, whose scatter is the session's. The path: the corners' pixels from the tilt to the stop,
freed of what every run has of its own (where the block lies, when it slipped, how much friction it slid with). Their
Fisher information about the effect's parameter, mu being free, adds over the runs; the detection limit is 2.8 standard
errors: 80 % power at a two-sided 5 %.

No model is exact to a thousandth of a pixel, so the analyst is a modest one: pixels count as if every ninth frame were
independent, and each run is granted freedoms of its own, known only to within these standard deviations: friction
while sliding 5 %, drag 1 /s, direction of the slide 3°, turn of the block during it 2°; another angle sensor's mean
    over a run
0.1°. And no model of a run is right to better than half a pixel in root mean square, however many frames there are.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.concealed.measure import to_plate
from tests.concealed.replay import replay
from tests.concealed.session import RunRecord, SessionRecord
from tests.concealed.world import BASE_HZ, FRAME, World

Array = NDArray[np.float64]
POWER_SIGMAS = 2.8
FRAMES_PER_FACT = 9.0
FREEDOMS = {"friction": 0.05, "drag_per_s": 1.0, "direction_rad": math.radians(3.0), "turn_rad": math.radians(2.0)}
SENSOR_RAD = math.radians(0.1)
MODEL_PX = 0.5
MOST_RUNS = 60
"""The limit is found on so many runs at most, evenly spread, and scaled."""
_STILL_EVERY = 6
_WALL_M = 3e-4
_ROUNDS, _NEAR = 9, 0.1
_JUMPING = 0.04
"""Share of the runs, those with the largest changes, whose paths are not counted."""
_SIDE_PATTERN = np.array([[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]])


@dataclass(frozen=True, eq=False, kw_only=True)
class Signature:
    """The changes that a world makes to each run of a session (n runs), in standard deviations of one run.

    `onset`: shift of the logarithm of the apparent friction at onset, over the scatter. `path`: what is left in the
    pixels after the run's own freedoms. `sensor`: against a second angle sensor. `every`: only each so many-th run
    was looked at.
    """

    runs: NDArray[np.int64]
    onset: Array
    path: Array
    sensor: Array
    every: int = 1

    @property
    def onset_information(self) -> float:
        """Squared standard errors that the onsets are away from the baseline's, mu being free."""
        shifted = self.onset - (self.onset.mean() if len(self.onset) else 0.0)
        return self.every * float((shifted**2).sum())

    @property
    def information(self) -> float:
        """Squared standard errors that the whole session is away from the baseline, mu being free."""
        if not len(self.onset):
            return 0.0
        # A block that slips just as a step ends may go now or with the next step: such a run's path jumps, and tells
        # of the simulation's last digit rather than of the effect.
        path = np.sort(self.path)[: len(self.path) - max(1, round(_JUMPING * len(self.path)))]
        return self.onset_information + self.every * float((path**2).sum() + (self.sensor**2).sum())


@dataclass(frozen=True, eq=False, kw_only=True)
class _Known:
    """One run as the session's own world explains it: what does not change from candidate to candidate."""

    run: RunRecord
    needed: float
    path: Array
    plates: Array
    chosen: NDArray[np.bool_]
    freedoms: Array
    """The run's own freedoms, over the noise: (8 × chosen frames, columns), the last ones with a prior of 1."""
    precision: Array
    """The precision of the freedoms: (columns, columns)."""


class Analyst:
    """Judges what other worlds would have done in place of a session's own one."""

    def __init__(self, session: SessionRecord, *, most_runs: int | None = None) -> None:
        self._session = session
        told = [run for run in session.runs if not run.censored and run.ride.truths[0] > run.ride.marks[0]]
        self._every = 1 if most_runs is None else max(1, -(-len(told) // most_runs))
        self._base = session.setting.world
        self._known = [_known(run, self._base) for run in told[:: self._every]]

    def signature(self, world: World) -> Signature:
        """Returns what `world` does to each run; censored runs say nothing."""
        setting = self._session.setting
        blur = math.hypot(SENSOR_RAD, math.radians(setting.design.sensor_noise_deg) / 5.0)
        rows: list[tuple[int, float, float, float]] = []
        for known in self._known:
            onset, path, tilt = _one(known, self._base, world)
            sensor = tilt / blur if setting.design.second_sensor else 0.0
            rows.append((int(known.run.facts.number) + 1, onset / setting.nuisance.scatter, path, sensor))
        table = np.array(rows, dtype=float).reshape(-1, 4)
        return Signature(
            runs=table[:, 0].astype(np.int64), onset=table[:, 1], path=table[:, 2], sensor=table[:, 3],
            every=self._every,
        )  # fmt: skip

    def limit(self, apply: Callable[[World, float], World], *, start: float, onset_only: bool = False) -> float:
        """The strength at which the session is `POWER_SIGMAS` standard errors away; inf if no strength is seen.

        The signature need not grow in proportion, so the root is searched by secants in logarithms.
        """
        value, last = start, (0.0, 0.0)
        for _ in range(_ROUNDS):
            signature = self.signature(apply(self._base, value))
            seen = math.sqrt(signature.onset_information if onset_only else signature.information)
            if seen <= 1e-9:
                return math.inf
            short = math.log(POWER_SIGMAS / seen)
            if abs(short) < _NEAR:
                return value * math.exp(short)
            slope = (math.log(seen) - last[1]) / (math.log(value) - last[0]) if last != (0.0, 0.0) else 1.0
            last = (math.log(value), math.log(seen))
            value *= math.exp(min(max(short / min(max(slope, 0.4), 2.5), -4.0), 4.0))
        return value


def _replay(run: RunRecord, world: World, *, later: float = 0.0, slower: float = 1.0) -> tuple[float, Array, Array]:
    """The friction that a lasting pull needs, the corners at the frames, the plate's tilt there."""
    done = run.ride
    end_k = min(int(done.marks[2]) + BASE_HZ // 3, run.from_k + len(done.arm) - 1)
    _, needed, path, plates = replay(
        world, run.facts, done.arm, run.from_k, int(done.marks[0]), float(done.truths[0]) + later, end_k, run.rest_at,
        run.start, slower,
    )  # fmt: skip
    return needed, path, plates


def _known(run: RunRecord, base: World) -> _Known:
    needed, path, plates = _replay(run, base)
    chosen = _chosen_frames(path, run, base)
    drag = base._replace(drag_per_s=base.drag_per_s + 0.02)
    columns = [
        *_poses(len(path)),
        (_replay(run, base, later=0.5)[1] - path) / 0.5,
        (_replay(run, base, slower=0.998)[1] - path) / 0.002 * FREEDOMS["friction"],
        (_replay(run, drag)[1] - path) / 0.02 * FREEDOMS["drag_per_s"],
        *_wanderings(path),
    ]
    sigma = run.facts.sigma_px * math.sqrt(FRAMES_PER_FACT)
    freedoms = np.stack([column[chosen].ravel() for column in columns], axis=1) / sigma
    prior = np.concatenate([np.full(4, 1e-9), np.ones(len(columns) - 4)])
    return _Known(
        run=run, needed=needed, path=path, plates=plates, chosen=chosen, freedoms=freedoms,
        precision=freedoms.T @ freedoms + np.diag(prior),
    )  # fmt: skip


def _one(known: _Known, base: World, world: World) -> tuple[float, float, float]:
    """Shift of ln mu at onset, size (sigmas) of what is left in the path, and the plate's mean difference of tilt."""
    run, late_s = known.run, world.late_s - base.late_s
    needed, path, plates = _replay(run, world)
    onset = -math.log(max(needed, 1e-6) / max(known.needed, 1e-6)) + _read_late(run, late_s)
    if not known.chosen.any():
        return onset, 0.0, 0.0
    change = path - known.path
    if late_s != 0.0:
        change = change - late_s * np.gradient(known.path, axis=0) * (BASE_HZ / FRAME)
    y = change[known.chosen].ravel() / (run.facts.sigma_px * math.sqrt(FRAMES_PER_FACT))
    b = known.freedoms.T @ y
    left = math.sqrt(max(float(y @ y - b @ np.linalg.solve(known.precision, b)), 0.0))
    # From the sum over n coordinates in noise units to their root mean square in pixels, and to what that is worth.
    noise_px = run.facts.sigma_px * math.sqrt(FRAMES_PER_FACT / len(y))
    left *= noise_px / math.hypot(noise_px, MODEL_PX)
    return onset, left, float(np.abs((plates - known.plates)[known.chosen]).mean())


def _read_late(run: RunRecord, late_s: float) -> float:
    """Shift of ln tan of the tilt that is read when the frames' stamps are late."""
    if late_s == 0.0:
        return 0.0
    at = float(run.ride.truths[0]) - run.from_k
    k = np.arange(len(run.ride.arm))
    now, then = np.interp([at, at + late_s * BASE_HZ], k, run.ride.arm[:, 0])
    return float(math.log(math.tan(then) / math.tan(now)))


def _wanderings(path: Array) -> list[Array]:
    """Returns the changes of the corners (n, 8 px) had the slide gone aside, or the block turned on its way."""
    corners = path.reshape(len(path), 4, 2)
    centre = corners.mean(axis=1)
    travel = centre - centre[0]
    aside = np.stack([-travel[:, 1], travel[:, 0]], axis=1) * FREEDOMS["direction_rad"]
    length = np.hypot(*travel.T)
    share = (length / max(float(length.max()), 1e-9))[:, None, None]
    around = corners - centre[:, None, :]
    turned = np.stack([-around[..., 1], around[..., 0]], axis=-1) * share * FREEDOMS["turn_rad"]
    return [np.tile(aside, (1, 4)), turned.reshape(len(path), 8)]


def _poses(count: int) -> list[Array]:
    """The corners' changes (n, 8 px) when the block lies elsewhere: to the right, below, turned."""
    turn = (_SIDE_PATTERN[:, ::-1] * np.array([-1.0, 1.0])).ravel()
    return [np.tile(row, (count, 1)) for row in (np.tile([1.0, 0.0], 4), np.tile([0.0, 1.0], 4), turn)]


def _chosen_frames(path: Array, run: RunRecord, world: World) -> NDArray[np.bool_]:
    """Every sixth frame before the onset, every one after it, until the block comes to the wall."""
    first = -(-int(run.ride.marks[0]) // FRAME)
    onset = max(int(run.ride.truths[0] // FRAME) - first, 0)
    chosen = np.zeros(len(path), dtype=bool)
    chosen[:onset:_STILL_EVERY] = True
    chosen[onset:] = True
    centre = to_plate(path, world).mean(axis=1)
    at_wall = np.flatnonzero(np.hypot(*centre.T) > world.wall_radius - _WALL_M)
    at_wall = at_wall[at_wall > onset + 5]  # a block may start there
    if len(at_wall):
        chosen[at_wall[0] :] = False
    return chosen
