"""A recorded session done again with another protocol: the same slides and the same noise, with what a plan changes.

Every run of the new session is one of the recorded runs, turned to its new direction, carried to its new place, with
its own dwell, load and rate of tilt. So windows, errors and the plate's motion are the rig's own, and only slopes are
asked of it: what a model's number would change in each row.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from station.diagnosis.observations.channel import Channel, Rows
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.moments import Changed, RunFacts
from station.diagnosis.observations.onsets import Onsets
from station.diagnosis.observations.plate import Times, turned
from station.diagnosis.observations.slides import Across, Along, Motion, Turn
from station.diagnosis.observations.windows import WEIGHTS
from station.physics.contact import Array, View
from station.physics.covariates import covariates_of
from station.physics.dissipation import threshold
from station.physics.effect import Effect
from station.physics.model import Model

Draw = dict[str, Array]
"""A session's protocol: numbers (runs,) by name. They are `down`, `yaw`, `mount` (rad), `x`, `y` (m), `mass_kg`, `rate`
(of the tilt, rad/s), `dwell_s` (before the tilt begins) and `number` (of the run)."""

Sliding = Along | Across | Turn
"""The channels of a slide."""

STANDARD_RATE_RAD_S, LEAST_RATE_RAD_S = math.radians(5.0), math.radians(0.5)
"""The rate of a plate that held at the onset is the former; a slower plate holds."""
LEAST_DWELL_S = 0.05
SAME_RAD = 0.01
"""Blocks whose ways differ by less go the same way: what a number changes in the rows then differs by 1 %, for a grain
by 4 % (`pytest tests/unit/diagnosis/test_redone.py`), while a promise is known to 2 of 80 %. With a session for every
truth a demonstration's plan took 25 s, with this 12."""


@dataclass(frozen=True, eq=False)
class Recorded:
    """A session that can be done again: its evidence, its runs with an onset (r,) and these onsets' rows (r,).

    `kept` has the residuals of the channels that no plan changes.
    """

    evidence: Evidence
    onsets: Onsets
    runs: Times
    rows: Times
    kept: Mapping[str, _Remembered]

    @classmethod
    def of(cls, evidence: Evidence) -> Recorded | None:
        """Returns the session's runs that slid; None without any."""
        onsets = evidence.channel("onset")
        if not isinstance(onsets, Onsets) or onsets.rows.limit.all():
            return None
        rows = np.flatnonzero(~onsets.rows.limit & evidence.counted[onsets.rows.run])
        kept = {one.name: _Remembered(one) for one in evidence.channels if not isinstance(one, Onsets | Sliding)}
        return cls(evidence, onsets, onsets.rows.run[rows], rows, kept)

    def protocol(self) -> Draw:
        """Returns the protocol (r,) that the session had."""
        at, facts = self.onsets.moments.reported.chosen(self.rows), self.evidence.facts
        rate = self._rate()
        known = {
            "down": at.down_rad, "yaw": at.yaw_rad, "mount": at.mount_rad, "x": at.x_m, "y": at.y_m,
            "mass_kg": at.mass_kg, "rate": rate, "number": facts.number[self.runs],
            "dwell_s": np.fmax(facts.dwell_s[self.runs], LEAST_DWELL_S),
        }  # fmt: skip
        return {name: np.nan_to_num(values) for name, values in known.items()}

    def _rate(self) -> Array:
        """Returns the fastest tilt (r,) that each run's onset and slide have seen while the plate rose."""
        parts = [self.onsets.moments, *(one.motion.moments for one in self.evidence.channels if isinstance(one, Along))]
        fastest = np.zeros(self.evidence.runs)
        for moments in parts:
            at = moments.reported
            rate = np.linalg.norm(at.rate_rad_s, axis=1) * (at.rising > 0)
            np.maximum.at(fastest, moments.run, rate)
        rate = fastest[self.runs]
        return np.where(rate > LEAST_RATE_RAD_S, rate, STANDARD_RATE_RAD_S)


def redone(recorded: Recorded, picked: Times, draw: Draw, *, truths: Iterable[Model]) -> list[Evidence]:
    """Returns the session of the `picked` (n,) of the recorded runs, by their indices, with the protocol `draw` (n,).

    It is done once for each of `truths`, whose blocks slide in the directions in which its own begin to. Where those of
    an earlier one go the SAME ways, it is the very same session.
    """
    rows = _Rows(recorded, picked, draw)
    onsets, done = rows.onsets(), list[tuple[Array, Evidence]]()
    return [_slid(rows, onsets, rows.ways(truth, onsets), done) for truth in truths]


def _slid(rows: _Rows, onsets: Onsets, off_rad: Array, done: list[tuple[Array, Evidence]]) -> Evidence:
    """Returns the session whose blocks slide `off_rad` (n,) from the steepest way down, from `done` if it is there."""
    for known_rad, session in done:
        if np.abs(off_rad - known_rad).max() < SAME_RAD:
            return session
    done.append((off_rad, rows.evidence(onsets, off_rad)))
    return done[-1][1]


def _facts(facts: RunFacts, runs: Times, draw: Draw) -> RunFacts:
    return RunFacts(
        number=draw["number"],
        rest_ns=facts.rest_ns[runs],
        dwell_s=draw["dwell_s"],
        mount_rad=draw["mount"],
        mass_kg=draw["mass_kg"],
        area_m2=facts.area_m2[runs],
        temperature_c=facts.temperature_c[runs],
        relative_humidity=facts.relative_humidity[runs],
    )


class _Rows:
    """The rows of the new session's channels, from the recorded ones of the picked runs."""

    def __init__(self, recorded: Recorded, picked: Times, draw: Draw) -> None:
        self._recorded, self._picked, before = recorded, picked, recorded.protocol()
        self._facts = _facts(recorded.evidence.facts, recorded.runs[picked], draw)
        at = recorded.onsets.moments.reported.chosen(recorded.rows[picked])
        old = {name: values[picked] for name, values in before.items()}
        self._turn = draw["down"] - old["down"]
        self._yaw = draw["yaw"] - old["yaw"]
        self._faster = draw["rate"] / old["rate"]
        tilt_rad = float(np.median(recorded.onsets.contact.tilt_rad))
        tilting_s = at.rest_s - old["dwell_s"] + tilt_rad * (1.0 / draw["rate"] - 1.0 / old["rate"])
        self._rest_s = draw["dwell_s"] + np.maximum(tilting_s, 0.0)
        self._from = np.column_stack([old["x"], old["y"]])
        self._to = np.column_stack([draw["x"], draw["y"]])
        self._off = np.zeros(len(picked))

    def evidence(self, onsets: Onsets, off_rad: Array) -> Evidence:
        """Returns the whole session, whose blocks slide `off_rad` (n,) from the steepest way down."""
        whole, self._off = self._recorded.evidence, off_rad
        channels = [onsets, *(self.other(channel, onsets) for channel in whole.channels if channel.name != "onset")]
        return replace(
            whole,
            channels=tuple(channel for channel in channels if len(channel)),
            run_number=self._facts.number,
            facts=self._facts,
            total_runs=len(self._picked),
            paths=None,
            slide_tracks=None,
            held_out=None,
        )

    def ways(self, truth: Model, onsets: Onsets) -> Array:
        """Returns the directions (n,), rad, from the steepest way down, in which a model's blocks begin to slide."""
        load = onsets.moments.loads(truth)
        toward = np.arctan2(load.tangential[:, 1], load.tangential[:, 0])
        _, way = threshold(truth, load.contact, toward)
        off = way - onsets.moments.reported.down_rad
        return np.mod(off + np.pi, 2 * np.pi) - np.pi

    def onsets(self) -> Onsets:
        """Returns the onsets, one to a run."""
        recorded = self._recorded
        own = np.arange(len(self._picked))
        moments = recorded.onsets.moments.again(self._changed(recorded.rows[self._picked], own))
        rows = _chosen(recorded.onsets.rows, recorded.rows[self._picked], own)
        return Onsets(replace(rows, covariates=covariates_of(moments.reported)), moments)

    def other(self, channel: Channel, onsets: Onsets) -> Channel:
        """Returns a slide's channel done again; any other as it was recorded."""
        rows, run = self._of_runs(channel.rows.run)
        if not isinstance(channel, Sliding):
            return _Kept(channel, self._recorded.kept[channel.name], rows, run)
        motion = self._motion(channel.motion, rows, run, onsets)
        middle = {name: values[1 :: len(WEIGHTS)] for name, values in covariates_of(motion.moments.reported).items()}
        return type(channel)(replace(_chosen(channel.rows, rows, run), covariates=middle), motion)

    def _of_runs(self, run: Times) -> tuple[Times, Times]:
        """Returns the rows (m,) of the picked runs among rows of the runs `run`, and their new runs (m,)."""
        order = np.argsort(run, kind="stable")
        wanted = self._recorded.runs[self._picked]
        first, last = (np.searchsorted(run[order], wanted, side=side) for side in ("left", "right"))
        rows = [order[begin:end] for begin, end in zip(first, last, strict=True)]
        return np.concatenate(rows), np.repeat(np.arange(len(wanted)), last - first)

    def _changed(self, rows: Times, run: Times) -> Changed:
        return Changed(
            rows=rows,
            run=run,
            facts=self._facts,
            turn_rad=self._turn[run],
            from_m=self._from[run],
            to_m=self._to[run],
            yaw_rad=self._yaw[run],
            faster=self._faster[run],
            rest_s=self._rest_s[run],
            off_rad=self._off[run],
        )

    def _motion(self, motion: Motion, rows: Times, run: Times, onsets: Onsets) -> Motion:
        nodes = (len(WEIGHTS) * rows[:, None] + np.arange(len(WEIGHTS))).ravel()
        changed = self._changed(nodes, np.repeat(run, len(WEIGHTS)))
        way = np.column_stack([np.cos(self._turn[run]), np.sin(self._turn[run])])
        count = len(self._picked)
        rate = motion.yaw_rate_rad_s
        return Motion(
            motion.moments.again(changed),
            turned(motion.acceleration_m_s2[rows], way),
            motion.yaw_acceleration_rad_s2[rows],
            lambda model: _of_rows(onsets.run_effects(model, count), run),
            rate[nodes] if isinstance(rate, np.ndarray) else rate,
            turned(motion.between[rows], way),
            None if motion.view is None else _seen_again(motion.view, changed),
        )


def _of_rows(values: tuple[Array, Array], run: Times) -> tuple[Array, Array]:
    return values[0][run], values[1][run]


def _seen_again(view: View, changed: Changed) -> View:
    rows, way = changed.rows, changed.way
    points = view.point_m[rows]
    flat = (points - changed.from_m[:, None, :]).reshape(-1, 2)
    corners, gained = points.shape[1], np.broadcast_to(view.acceleration_m_s2, view.velocity_m_s.shape)
    moved = turned(flat, np.repeat(way, corners, axis=0)).reshape(points.shape) + changed.to_m[:, None, :]
    return replace(
        view,
        point_m=moved,
        velocity_m_s=turned(view.velocity_m_s[rows], way) * changed.swifter[:, None],
        yaw_rate_rad_s=view.yaw_rate_rad_s[rows],
        tilt_rad=view.tilt_rad[rows],
        down_rad=view.down_rad[rows] + changed.turn_rad,
        rest_s=view.rest_s[rows],
        acceleration_m_s2=turned(gained[rows], way) * changed.swifter[:, None] ** 2,
    )


def _chosen(rows: Rows, chosen: Times, run: Times) -> Rows:
    return Rows(
        run=run,
        from_ns=rows.from_ns[chosen],
        to_ns=rows.to_ns[chosen],
        sigma=rows.sigma[chosen],
        astray=rows.astray[chosen],
        limit=rows.limit[chosen],
        covariates={name: values[chosen] for name, values in rows.covariates.items()},
    )


class _Remembered:
    """The residuals of a recorded channel by the model, each found once: every design asks for those of the same."""

    def __init__(self, channel: Channel) -> None:
        self._channel, self._known = channel, dict[object, Array]()

    def __call__(self, model: Model) -> Array:
        """Returns the residuals (n,) of the whole channel."""
        terms = ((term.effect, tuple(term.values.items())) for term in model.terms)
        key = (model.mu_s, *terms)
        if key not in self._known:
            self._known[key] = self._channel.residual(model)
        return self._known[key]


class _Kept(Channel):
    """Rows of a channel that no plan changes: pictures at rest, marks on the plate, other angle sensors."""

    def __init__(self, whole: Channel, residual: _Remembered, chosen: Times, run: Times) -> None:
        super().__init__(_chosen(whole.rows, chosen, run))
        self.name, self.phase, self.unit, self.trusted = whole.name, whole.phase, whole.unit, whole.trusted
        self.shares_friction = whole.shares_friction
        self._whole, self._residual, self._chosen = whole, residual, chosen

    def changed_by(self, effect: Effect) -> bool:
        """Returns true if the recorded channel is changed by the effect."""
        return self._whole.changed_by(effect)

    def residual(self, model: Model) -> Array:
        """Returns the residuals of the chosen rows."""
        return self._residual(model)[self._chosen]
