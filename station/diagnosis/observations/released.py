"""The friction that slips tell under models whose pushes depend on the plate's motion.

A block that is pushed in time with the plate's motion slips at a crest of the push. Its friction is the load of that
moment, and not the one that the same tilt has on a plate at rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from station.diagnosis.observations.moments import Latest, Moments, still
from station.diagnosis.observations.plate import Times
from station.diagnosis.observations.slips import Slipping
from station.diagnosis.observations.starts import starts
from station.diagnosis.observations.swing import Swing
from station.diagnosis.observations.tracks import RunTrack
from station.physics.contact import Array, Contact
from station.physics.model import Model, Term

if TYPE_CHECKING:
    from station.diagnosis.observations.build import Recorded

PITCH = 4
"""Every so many points of a run's even grid are looked at: 4 ms, while an arm's ringing takes tens of them."""


class Released:
    """The slips of runs (r,), each seen at moments (m,) from its rest on; their onsets stand in `rows` (r,) of n."""

    def __init__(self, slips: Sequence[Slipping], contact: Contact, *, rows: Times, count: int) -> None:
        """`contact` (r m) has the resting blocks at the moments of `seen_ns`, and `count` is n."""
        self._rows, self._count = rows, count
        self._swing, self._weight = _swing(slips), _weights(slips)
        self._way = np.repeat(self._swing.way, self._weight.shape[1], axis=0)
        self._contact, self._still = contact, still(contact)
        fastest = contact.chosen(_fastest(contact, self._weight.shape))
        self._fastest, self._stopped = fastest, still(fastest)
        self._moved = Latest(self._moves, ("push",))
        self._plain = self._log_slope(np.zeros((2, *self._weight.shape)))

    def log_moved(self, model: Model) -> Array:
        """Returns the log friction of the onsets (n,) that the pushes of the moving plate add."""
        return self._moved(model)

    def _moves(self, model: Model) -> Array:
        found = np.zeros(self._count)
        moving = replace(model, terms=tuple(term for term in model.acting("push") if self._is_of_motion(term)))
        if moving.terms:
            push = moving.push(self._contact) - moving.push(self._still)
            added = np.array([(push[:, :2] * self._way).sum(axis=1), -push[:, 2]])
            found[self._rows] = self._log_slope(added.reshape(2, *self._weight.shape)) - self._plain
        return found

    def _is_of_motion(self, term: Term) -> bool:
        """Returns false for a push that a plate at rest has as well.

        Such a push is contained in the tilt at which it would release a block.
        """
        moving, stopped = (term.effect.push(contact, term.values) for contact in (self._fastest, self._stopped))
        return bool(np.any(moving != stopped))

    def _log_slope(self, added: Array) -> Array:
        """Returns the log of the slopes (r,) at which plates at rest would release the blocks, see `Swing.tilt_rad`."""
        tilt = np.maximum.accumulate(self._swing.tilt_rad(added), axis=1)
        return np.log(np.tan((tilt * self._weight).sum(axis=1)))


def _fastest(contact: Contact, shape: tuple[int, int]) -> Times:
    """Returns the moments (2 r,) of the runs in which the plate turns fastest, and those in which that changes most."""
    sizes = (
        np.linalg.norm(motion, axis=1).reshape(shape) for motion in (contact.rate_rad_s, contact.acceleration_rad_s2)
    )
    first = shape[1] * np.arange(shape[0])
    return np.concatenate([first + size.argmax(axis=1) for size in sizes])


def released(recorded: Recorded, runs: Sequence[int]) -> Released | None:
    """Returns the slips of the onsets of these `runs` (n,), by their indices, as far as their paths were read.

    Otherwise it is None.
    """
    read = {run: slip for run, slip in recorded.reread.slips.items() if slip.run.swing is not None}
    rows = [row for row, run in enumerate(runs) if run in read]
    if not rows:
        return None
    chosen = [runs[row] for row in rows]
    slips, tracks = [read[run] for run in chosen], [recorded.tracks[run] for run in chosen]
    return Released(slips, _contact(recorded, slips, tracks, chosen), rows=np.array(rows), count=len(runs))


def _contact(recorded: Recorded, slips: Sequence[Slipping], tracks: Sequence[RunTrack], runs: Sequence[int]) -> Contact:
    """Returns the resting blocks (r m) at the moments at which slips are looked at."""
    time_ns = seen_ns(slips)
    pose = np.repeat(starts(tracks), time_ns.shape[1], axis=0)
    return Moments(
        time_ns=time_ns.ravel(),
        run=np.repeat(runs, time_ns.shape[1]),
        facts=recorded.facts,
        attitude=lambda delay_s: recorded.slipping.at(time_ns.ravel(), delay_s=delay_s),
        place_m=pose[:, :2],
        yaw_rad=pose[:, 2],
    ).reported


def seen_ns(slips: Sequence[Slipping]) -> Times:
    """Returns the moments (r, m), ns, at which slips are looked at."""
    seen = np.array([slip.run.grid_s[node] for slip, node in zip(slips, _nodes(slips), strict=True)])
    return np.array([slip.origin_ns for slip in slips])[:, None] + np.round(1e9 * seen).astype(np.int64)


def _nodes(slips: Sequence[Slipping]) -> Times:
    """Returns the points (r, m) of the runs' grids looked at, up to the last moment of a slip and then that again."""
    last = np.array([int(np.searchsorted(slip.run.grid_s, slip.tried_s[-1])) // PITCH + 1 for slip in slips])
    most = np.array([(len(slip.run.grid_s) - 1) // PITCH for slip in slips])
    return PITCH * np.minimum(np.arange(last.max() + 1), np.minimum(last, most)[:, None])


def _weights(slips: Sequence[Slipping]) -> Array:
    """Returns the weights (r, m) of the points, by which values there are interpolated to the moments and averaged."""
    nodes = _nodes(slips)
    found = np.zeros(nodes.shape)
    for row, slip in enumerate(slips):
        grid = slip.run.grid_s
        position = np.clip((slip.tried_s - grid[0]) / (grid[PITCH] - grid[0]), 0.0, nodes[row, -1] / PITCH)
        before = np.minimum(position.astype(int), int(nodes[row, -1]) // PITCH - 1)
        np.add.at(found[row], before, slip.chance * (1.0 - (position - before)))
        np.add.at(found[row], before + 1, slip.chance * (position - before))
    return found


def _swing(slips: Sequence[Slipping]) -> Swing:
    """Returns the runs' loads at the points, (r, m) in place of (m,)."""
    nodes = _nodes(slips)
    parts = [(slip.run.swing, node) for slip, node in zip(slips, nodes, strict=True) if slip.run.swing]
    return Swing(
        way=np.array([swing.way for swing, _ in parts]),
        sliding=np.stack([swing.sliding[:, node] for swing, node in parts], axis=1),
        resting=np.stack([swing.resting[:, node] for swing, node in parts], axis=1),
        per_m=np.stack([swing.per_m[:, node] for swing, node in parts], axis=1),
        still_pull=np.array([swing.still_pull[node] for swing, node in parts]),
        plate_rad=np.array([swing.plate_rad[node] for swing, node in parts]),
    )
