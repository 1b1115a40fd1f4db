"""The sliding channels: friction along the motion, force across it, and the block's turning, window by window."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from shared.vectors import columns
from station.diagnosis import thresholds
from station.diagnosis.observations.channel import ACROSS, ALONG, Channel, Rows
from station.diagnosis.observations.moments import Latest, Load, Moments
from station.diagnosis.observations.windows import WEIGHTS
from station.physics.contact import Array, Contact, View, middle, unit
from station.physics.covariates import READ
from station.physics.dissipation import support_slope
from station.physics.effect import Effect
from station.physics.model import Model
from station.physics.sole import SQUARE_GYRATION, TURNING_RADIUS, carried_across, left_against_turning

LEAST_MU = 0.05
LEAST_M_S, LEAST_M_S2 = 1e-3, 1e-2
NEAR = 0.01
"""The share by which a window's speeds are widened for the slope of friction over them: some are all alike."""
LEAST_SLOPE_RAD = 0.05
"""A plate more level than this has no steepest line: a block slides there as it was sent."""
LEAST_WAY_M = 1e-4
"""A block that has gone less in a window has no way that a picture could turn; it guards a division."""


@dataclass(frozen=True, eq=False)
class Motion:
    """The windows' accelerations (n, 2), m/s², and (n,), rad/s², and their states at the nodes (3 n moments).

    `run_effects` gives for a model the log friction of the windows' runs (n,) over its own by their onsets, and those
    onsets' residuals; `yaw_rate_rad_s` (3 n,) is the block's turning at the nodes; `between_m_s2` (n, 3) is what the
    three nodes miss of the means of pull (2) and press over a window in which the plate is set in motion or stopped;
    `view` is the camera's view of the nodes. `usual_way_rad` (3 n,) is the way that slides of such runs go, rad in P:
    their own, unless it is given.
    """

    moments: Moments
    acceleration_m_s2: Array
    yaw_acceleration_rad_s2: Array
    run_effects: Callable[[Model], tuple[Array, Array]] | None = None
    yaw_rate_rad_s: Array | float = 0.0
    between_m_s2: Array | None = None
    view: View | None = None
    usual_way_rad: Array | None = None

    @property
    def usual_way(self) -> Array:
        """`usual_way_rad`, or the blocks' own ways (3 n,), rad in P, if it is not given."""
        return self.moments.reported.way_rad if self.usual_way_rad is None else self.usual_way_rad

    @property
    def between(self) -> Array:
        """`between_m_s2`, or zeros (n, 3) if it is not given."""
        return np.zeros((len(self.acceleration_m_s2), 3)) if self.between_m_s2 is None else self.between_m_s2

    @property
    def reach_m(self) -> Array:
        """The sole's turning radius ρ (3 n,), m, see `station.physics.sole`."""
        return TURNING_RADIUS * np.sqrt(self.moments.reported.area_m2)

    @property
    def sliding(self) -> Array:
        """The share (3 n,) of the friction that opposes the sliding; the rest opposes the turning.

        The limit surface is an ellipsoid (Howe & Cutkosky 1996, IJRR 15, 557).
        """
        speed = np.maximum(self.moments.reported.speed_m_s, LEAST_M_S)
        return speed / np.hypot(speed, self.reach_m * self.yaw_rate_rad_s)

    @cached_property
    def seen(self) -> Latest[Seen]:
        """Caches, by model, what `_seen` returns."""
        return Latest(self._seen, ("seen",))

    def _seen(self, model: Model) -> Seen:
        """Returns what the model's effects on the picture seem to do to the blocks.

        A lens that enlarges what is far from its axis makes a block that goes there seem to decelerate less, and one
        that passes beside the axis seem to turn off its way; rows that are read one after another turn its mark.
        """
        bending = replace(model, terms=tuple(term for term in model.acting("seen") if _bends(term.effect)))
        if self.view is None or not bending.acting("seen"):
            return Seen.nothing(len(self.acceleration_m_s2))
        true = self._true(self.view, bending.seen(self.view))
        shift = bending.seen(true)
        moved = middle(shift)
        first, _, last = self._at_nodes(moved)
        begin, _, end = self._at_nodes(self.view.centre_m)
        way, aside = end - begin, last - first
        turned = (way[:, 0] * aside[:, 1] - way[:, 1] * aside[:, 0]) / np.maximum((way**2).sum(axis=1), LEAST_WAY_M**2)
        rate, spin = (each[:, 0] for each in self._changes(_spun_rad(true, shift)[:, None]))
        return Seen(self._changes(moved)[1], turned, rate, spin)

    def _true(self, view: View, shift: Array) -> View:
        """Returns the view without the displacements `shift` (3 n, 4, 2), m, and the velocity that they seem to add."""
        velocity = view.velocity_m_s - self._changes(middle(shift))[0]
        return view.of(view.point_m - shift).moving(velocity, view.acceleration_m_s2)

    def _changes(self, place: Array) -> tuple[Array, Array]:
        """Returns the first (3 n, k), 1/s, and the second derivative (n, k), 1/s², of what is at the nodes (3 n, k)."""
        times_ns = self.moments.time_ns.reshape(-1, len(WEIGHTS))
        half_s = 0.5e-9 * (times_ns[:, -1] - times_ns[:, 0])[:, None]
        first, middle_one, last = self._at_nodes(place)
        slope, bend = (last - first) / (2.0 * half_s), (first - 2.0 * middle_one + last) / half_s**2
        return np.stack([slope - half_s * bend, slope, slope + half_s * bend], axis=1).reshape(place.shape), bend

    @staticmethod
    def _at_nodes(values: Array) -> Array:
        """Returns what is at the first, middle and last nodes (3, n, k) of the windows, of (3 n, k)."""
        return values.reshape(-1, len(WEIGHTS), values.shape[1]).transpose(1, 0, 2)


class Seen(NamedTuple):
    """The motion that a picture seems to add to the windows' own.

    It is an acceleration (n, 2), m/s², by how far left their ways seem turned (n,), rad, a rate at which the blocks
    seem to turn at the nodes (3 n,), rad/s, and its change (n,), rad/s².
    """

    acceleration_m_s2: Array
    turned_rad: Array
    rate_rad_s: Array
    spin_rad_s2: Array

    @classmethod
    def nothing(cls, count: int) -> Seen:
        """Returns that of a picture that shows `count` windows as they were."""
        return cls(np.zeros((count, 2)), np.zeros(count), np.zeros(len(WEIGHTS) * count), np.zeros(count))


def _spun_rad(view: View, shift: Array) -> Array:
    """Returns the angle (m,), rad, by which displacements `shift` (m, 4, 2), m, of its corners seem to turn a mark."""
    out = view.point_m - view.centre_m[:, None, :]
    across = out[..., 0] * shift[..., 1] - out[..., 1] * shift[..., 0]
    return across.sum(axis=1) / np.square(out).sum(axis=(1, 2))


def _bends(effect: Effect) -> bool:
    """Returns true if an effect displaces the picture of a block that slides."""
    return effect.layer == "camera" and "seen" in effect.acts_through()


class _Slides(Channel):
    phase: str = "slide"
    sees: bool = False
    """True if the channel compares forces or moments, from accelerations in the picture."""

    def changed_by(self, effect: Effect) -> bool:
        """Returns true also for effects that bend the picture, which show in the mark's shape far more."""
        return super().changed_by(effect) or (self.sees and _bends(effect))

    def __init__(self, rows: Rows, motion: Motion) -> None:
        super().__init__(rows)
        self.motion = motion
        contact, middle = motion.moments.reported, len(WEIGHTS) // 2
        x_m, y_m = (values[middle :: len(WEIGHTS)] for values in (contact.x_m, contact.y_m))
        self.travelled_m = np.cumsum(np.hypot(np.diff(x_m, prepend=x_m[:1]), np.diff(y_m, prepend=y_m[:1])))

    @cached_property
    def lasting_s(self) -> Array:
        """The times (n,), s, in which friction that a window is the first to show has changed its motion.

        They begin where the run's window before ends.
        """
        begin_ns, same = self.rows.from_ns.copy(), np.diff(self.rows.run) == 0
        begin_ns[1:][same] = self.rows.to_ns[:-1][same]
        return 1e-9 * np.maximum(self.rows.to_ns - begin_ns, 0)

    def _mean(self, values: Array) -> Array:
        """Returns the mean over each window's nodes with the weak form's weights: (3 n,) to (n,)."""
        return values.reshape(len(self), len(WEIGHTS)) @ WEIGHTS

    def _run_effects(self, model: Model) -> tuple[Array | float, Array | float]:
        """Returns the runs' log friction and residuals, see `Motion`; 0 without onsets."""
        return (0.0, 0.0) if self.motion.run_effects is None else self.motion.run_effects(model)

    def _middle(self, toward: Array) -> Array:
        """Returns the windows' mean unit vectors (n, 2) of directions (3 n, 2)."""
        mean = columns(self._mean(toward[:, 0]), self._mean(toward[:, 1]))
        return mean / np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-12)

    def _changed(self, model: Model, load: Load, toward: Array, middle: Array) -> Array:
        """Returns the pull (n,), m/s², that a model adds in directions (3 n, 2), and at the `middle` ones (n, 2)."""
        added = self._mean(_dot(load.tangential - self.motion.moments.plain.tangential, toward))
        return added + _dot(self.motion.seen(model).acceleration_m_s2, middle)

    def _force(self, load: Load, toward: Array) -> Array:
        """Gives the pull (n,), m/s², in directions (3 n, 2), less the windows' accelerations: the recorded friction."""
        gained = self.motion.acceleration_m_s2 - self.motion.between[:, :2]
        return self._mean(_dot(load.tangential, toward)) - _dot(gained, self._middle(toward))


class Along(_Slides):
    """Friction along the motion: log of the recorded coefficient less log of the predicted one.

    The recorded one uses the attitude as reported. What a model changes of that enters the prediction, lest a fit make
    the noise small by making the friction large. A run's random effect multiplies the friction and not that change:
    with an effect of a fifth, and a level error that is a fifth of the tilt, that would be four per cent.
    """

    name: str = ALONG
    title: str = "the friction along the slide"
    sees: bool = True
    unit: str = "relative friction"
    shares_friction: bool = True
    frictional: bool = True
    undone_by: frozenset[str] = frozenset({"friction", "push"})
    trusted: float = thresholds.FRICTION_TRUSTED

    def __init__(self, rows: Rows, motion: Motion) -> None:
        super().__init__(rows, motion)
        self.level_tells = motion.run_effects is not None
        self._plain = motion.moments.plain
        self._sliding = motion.sliding
        self._way = self._plain.contact.way
        self._middle_way = self._middle(self._way)
        self._normal = self._mean(self._plain.normal) + motion.between[:, 2]
        force = self._force(self._plain, self._way) / self._normal
        self._typical = max(float(np.median(force)), LEAST_MU)
        self._log_recorded = np.log(np.maximum(force, 0.2 * self._typical))

    @property
    def contact(self) -> Contact:
        """The recorded contacts at the windows' nodes (3 n,)."""
        return self.motion.moments.reported

    def friction_m_s2(self) -> Array:
        """Returns the recorded friction of each window per mass (n,), m/s²."""
        return np.exp(self._log_recorded) * self._normal

    def residual(self, model: Model) -> Array:
        """Returns the log of recorded over predicted friction (n,), plus the residual of the run's onset."""
        load = self.motion.moments.loads(model)
        run_effects, onset = self._run_effects(model)
        friction = model.friction(load.contact) * self._sliding
        held = self._mean(load.normal * friction) + self.motion.between[:, 2] * self._mean(friction)
        held = held * np.exp(run_effects)
        predicted = (held - self._changed(model, load, self._way, self._middle_way)) / self._normal
        return self._log_recorded - np.log(np.maximum(predicted, 0.05 * self._typical)) + onset

    def decay(self, model: Model) -> Array:
        """Returns how often (n,) friction or a drag undoes what a window's speed changes: by its slope over that."""
        if not any(map(model.acting, self.undone_by)):
            return np.zeros(len(self))
        slow, fast = (self._holding(model, contact) for contact in self._speeds)
        return self.lasting_s * (fast - slow) / (self._speeds[1].speed_m_s - self._speeds[0].speed_m_s)

    def _holding(self, model: Model, contact: Contact) -> Array:
        """Returns what holds the block back (n,), m/s², at contacts (n,) of the windows."""
        pushed = model.push(contact)[:, :2] if model.acting("push") else np.zeros((len(contact), 2))
        return self._normal * model.friction(contact) - _dot(pushed, contact.way)

    def undone(self, covariate: str, columns_of: Callable[[Array], Array]) -> Array | float:
        """Returns the change (n, k) of `decay`; friction that is larger makes the residual smaller."""
        if covariate not in READ:
            return 0.0
        slow, fast = (columns_of(READ[covariate](contact)) for contact in self._speeds)
        gained_m_s = self._speeds[1].speed_m_s - self._speeds[0].speed_m_s
        return -(self.lasting_s * self.friction_m_s2() / gained_m_s)[:, None] * (fast - slow)

    @cached_property
    def _speeds(self) -> tuple[Contact, Contact]:
        """The contacts (n,) at the windows' middles, at the slowest and the fastest speed of each window."""
        middle = self.contact.chosen(np.arange(len(WEIGHTS) // 2, len(self.contact), len(WEIGHTS)))
        speed = np.maximum(self.contact.speed_m_s, LEAST_M_S).reshape(len(self), len(WEIGHTS))
        slow = replace(middle, speed_m_s=(1.0 - NEAR) * speed.min(axis=1))
        return slow, replace(middle, speed_m_s=(1.0 + NEAR) * speed.max(axis=1))

    def off(self, model: Model) -> Array:
        """Returns the friction (n,) along the slide less that of the run's onset: a drop leaves it below throughout."""
        return self.residual(model) - self._run_effects(model)[1]


class Across(_Slides):
    """Sideways force to the left of the motion: recorded minus predicted, relative to the typical friction.

    The recorded one is that across the block's own way. A run's own sideways friction, as of a sole that lies unevenly,
    holds the block on a way beside the steepest line: there it is as large as the pull across the way. What a model
    adds to the pull is therefore taken across the way that is expected of any block under its load. Across the block's
    own way a steeper plate would add a share of the very residual that it is to explain, and few runs with uneven soles
    would seem to prove an offset of the angle.

    For the same reason a law's slope is taken on the way of similar runs: a run's own sideways friction sets its own,
    and four such runs seemed to prove a grain (`RIG_SEED=20261873 RIG_SESSIONS=1 pytest -m benchmark -s
    tests/benchmarks/test_rig_as_it_comes.py`).
    """

    name: str = ACROSS
    title: str = "the sideways force"
    frictional: bool = True
    sees: bool = True
    unit: str = "relative friction"
    trusted: float = thresholds.FRICTION_TRUSTED

    def __init__(self, rows: Rows, motion: Motion) -> None:
        super().__init__(rows, motion)
        self._plain = motion.moments.plain
        self._left = unit(self._plain.contact.way_rad + np.pi / 2)
        self._sloped = self._plain.contact.tilt_rad >= LEAST_SLOPE_RAD
        self._level = self._plain.contact.tilt_axis[:, :2]
        self._runs = np.repeat(rows.run, len(WEIGHTS))
        self._middle_left = self._middle(self._left)
        along = self._force(self._plain, self._plain.contact.way)
        self._unit_force = np.maximum(
            self._mean(self._plain.normal) * float(np.median(along / self._mean(self._plain.normal))), 1e-3
        )
        self._recorded = self._force(self._plain, self._left) / self._unit_force

    def residual(self, model: Model) -> Array:
        """Returns recorded minus predicted sideways force (n,), relative to the friction."""
        load = self.motion.moments.loads(model)
        slope = support_slope(model, load.contact, self.motion.usual_way)
        if model.acting("lead") or model.acting("seen"):
            slope = slope + model.friction(load.contact) * self._aside(model)
        held = self._mean(load.normal * slope) * np.exp(self._run_effects(model)[0])
        changed = self._changed(model, load, self._expected_left(load, held), self._middle_left)
        return self._recorded - (held - changed) / self._unit_force

    def _aside(self, model: Model) -> Array:
        """Returns the share (3 n,) of friction that holds across the recorded way, to its right.

        A leading pressure carries it aside by turning, see `station.physics.sole`, and it acts against the true way,
        from which the picture turns the recorded one.
        """
        contact, seen = self._plain.contact, self.motion.seen(model)
        turned = np.repeat(seen.turned_rad, len(WEIGHTS))
        if not model.acting("lead"):
            return -turned
        rate, side_m = self.motion.yaw_rate_rad_s - seen.rate_rad_s, np.sqrt(contact.area_m2)
        speed = contact.speed_m_s
        return carried_across(model.lead(contact), side_m, yaw_rate_rad_s=rate, speed_m_s=speed) - turned

    def _expected_left(self, load: Load, held: Array) -> Array:
        """Returns the left (3 n, 2) of blocks' ways under a load of which friction holds `held` (n,), m/s², sideways.

        A slide turns off the recorded steepest line by what its whole course adds up to.
        """
        contact, runs = self._plain.contact, self._runs
        along = _dot(load.tangential, contact.down)
        aside = _dot(load.tangential, self._level) - np.repeat(held, len(WEIGHTS))
        turned = np.arctan2(*(np.bincount(runs, values * self._sloped) for values in (aside, along)))[runs]
        return unit(np.where(self._sloped, contact.down_rad + turned, contact.way_rad) + np.pi / 2)


class Turn(_Slides):
    """Angular acceleration of the sliding block, rad/s²: recorded minus that of the driving and opposing moments.

    The friction is the recorded one: a model that changed it would change how much noise of the turning enters, and be
    fitted to that.
    """

    name: str = "turn"
    title: str = "the block's turning"
    sees: bool = True
    unit: str = "rad/s²"
    undone_by: frozenset[str] = frozenset({"lead"})
    trusted: float = thresholds.TURN_TRUSTED_RAD_S2

    def __init__(self, rows: Rows, motion: Motion) -> None:
        super().__init__(rows, motion)
        plain, contact = motion.moments.plain, motion.moments.reported
        force = np.maximum(self._force(plain, plain.contact.way), LEAST_M_S2)
        self._held = np.repeat(force, len(WEIGHTS))
        self._per_friction = 1.0 / (SQUARE_GYRATION * contact.area_m2)
        self._resisting = self._per_friction * motion.reach_m**2 / np.maximum(contact.speed_m_s, LEAST_M_S)

    def residual(self, model: Model) -> Array:
        """Returns recorded minus predicted angular acceleration (n,), rad/s²."""
        motion = self.motion
        contact = motion.moments.reported
        seen = motion.seen(model)
        against = self._resisting * (motion.yaw_rate_rad_s - seen.rate_rad_s)
        if model.acting("lead"):
            against = against * left_against_turning(model.lead(contact))
        moment = model.moment(contact, self._held, self._across(model)) if model.acting("lever") else 0.0
        predicted = moment * self._per_friction - self._held * against + model.spin(contact)
        turned = motion.yaw_acceleration_rad_s2 - seen.spin_rad_s2
        return turned - self._mean(np.broadcast_to(predicted, len(motion.moments)))

    def decay(self, model: Model) -> Array:
        """Returns how often (n,) friction against the turning undoes what a window's turning changes."""
        lead = model.lead(self.motion.moments.reported)
        return self.lasting_s * self._mean(self._held * self._resisting * left_against_turning(lead))

    def _across(self, model: Model) -> Array:
        """Returns the friction (3 n,) to the right of the way, m/s²: by the slope of the model's limit curve."""
        contact = self.motion.moments.reported
        return self._held * support_slope(model, contact, contact.way_rad) / model.friction(contact)


def _dot(one: Array, other: Array) -> Array:
    """Returns scalar products (n,) of vectors (n, 2); a sum over an axis of two would take several times as long."""
    return one[:, 0] * other[:, 0] + one[:, 1] * other[:, 1]
