"""The contact at chosen moments of a recording, and the loads there under a model."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np

from station.diagnosis.observations.driving import fictitious
from station.diagnosis.observations.plate import Attitude, Times, turned
from station.physics.contact import Array, Bools, Contact
from station.physics.model import Model, Term

T = TypeVar("T")

LEAST_REST_S = 1e-3
LEAST_M_S2 = 1e-3
"""The smallest press: a block that is lifted would have no friction to take a logarithm of."""

LEANING = ("attitude", "motion", "delay_s")
"""The methods of an effect that change how the plate stands and moves."""

LOADING = (*LEANING, "push")
"""The methods of an effect that change how a block is loaded."""


@dataclass(frozen=True, eq=False, kw_only=True)
class RunFacts:
    """The facts of each run (r,), with the meanings of `Contact`.

    `rest_ns` is when the block came to rest, and `dwell_s` how long it lay there before the tilt began.
    """

    number: Array
    rest_ns: Times
    dwell_s: Array
    mount_rad: Array
    mass_kg: Array
    area_m2: Array
    temperature_c: Array
    relative_humidity: Array


@dataclass(frozen=True, eq=False)
class Load:
    """A contact under a model, and its pull `tangential` (n, 2) and press `normal` (n,), m/s²."""

    contact: Contact
    tangential: Array
    normal: Array

    @cached_property
    def still(self) -> Contact:
        """The contact on a plate that does not move."""
        return still(self.contact)


class Latest(Generic[T]):
    """Caches what a model makes through some hooks, until a model acts otherwise through them.

    Several channels ask in turn, and most models that are compared differ in their friction alone.
    """

    def __init__(self, make: Callable[[Model], T], hooks: Sequence[str]) -> None:
        self._make, self._hooks = make, hooks
        self._of: Model | None = None
        self._last: tuple[Sequence[tuple[Term, ...]], T] | None = None

    def __call__(self, model: Model) -> T:
        """Returns the cached result, or a new one if the model acts otherwise through the hooks."""
        if self._last is None or self._of is not model:
            acting = [model.acting(hook) for hook in self._hooks]
            if self._last is None or self._last[0] != acting:
                self._last = (acting, self._make(model))
            self._of = model
        return self._last[1]


@dataclass(frozen=True, eq=False, kw_only=True)
class Changed:
    """Changes of m rows whose runs are done again: `rows` are the recorded ones, `run` (m,) the new runs' indices.

    The run is turned about the plate's normal by `turn_rad` (m,) and carried from the place `from_m` to `to_m` (m, 2);
    the block's heading changes by `yaw_rad` (m,), the tilt is `faster` (m,) by a factor, the block has rested for
    `rest_s` (m,) at the onset, and slides off the line down the slope by `off_rad` (m,).
    """

    rows: Times
    run: Times
    facts: RunFacts
    turn_rad: Array
    from_m: Array
    to_m: Array
    yaw_rad: Array
    faster: Array
    rest_s: Array
    off_rad: Array

    @property
    def way(self) -> Array:
        """Unit vectors (m, 2) of the turns."""
        return np.column_stack([np.cos(self.turn_rad), np.sin(self.turn_rad)])

    @property
    def swifter(self) -> Array:
        """The factor (m,) on a slide's speed at the same place, and on its inverse duration.

        A block that starts to slide on a plate tilted at the rate w has gone g w t³ / 6 and has the speed g w t² / 2.
        """
        return np.cbrt(self.faster)


class Moments:
    """n moments: time, run, and the block's place; `attitude` gives the plate's by a delay (s) earlier.

    `attitude` is kept as long as the evidence: it should know the plate's motion, and not the whole recording.

    By default the block rests at the plate's origin, far from any foam.
    `delay_s` says by how much a model lets the moments' stamps be late: as the camera's, by default.
    With `at_rest` the plate's own motion does not load the block: an onset that is read by tracing a slide back
    measures the slide's friction, not the load of its very moment; and `steeper_rad` (n,) is by how much more than
    reported a plate at rest would have to be tilted for the same load. `rest_s` (n,), if given, replaces the time at
    rest, and `rest_s_at` gives it at other tilts (n,). Both must be what the protocol chose: the time up to the slip
    itself is longer where friction happens to be high, and friction would seem to grow with it.
    `evened`, if given, gives the mean accelerations (n, 3), rad/s², that a model's own motion of the plate adds over
    windows of moments.
    """

    def __init__(
        self,
        *,
        time_ns: Times,
        run: Times,
        facts: RunFacts,
        attitude: Callable[[float], Attitude],
        place_m: Array | None = None,
        yaw_rad: Array | None = None,
        velocity_m_s: Array | None = None,
        moving: Bools | None = None,
        slip_ns: Times | None = None,
        border_m: Array | None = None,
        rest_s: Array | None = None,
        rest_s_at: Callable[[Array | float], Array] | None = None,
        at_rest: bool = False,
        steeper_rad: Array | float = 0.0,
        delay_s: Callable[[Model], float] = Model.delay_s,
        evened: Callable[[Model], Array] | None = None,
    ) -> None:
        self.time_ns, self.run = time_ns, run
        self._facts, self._attitude = facts, attitude
        count = len(time_ns)
        self._place = np.zeros((count, 2)) if place_m is None else place_m
        self._yaw = np.zeros(count) if yaw_rad is None else yaw_rad
        self._velocity = np.zeros((count, 2)) if velocity_m_s is None else velocity_m_s
        self._moving = np.zeros(count, dtype=np.bool_) if moving is None else moving
        self._slip_ns = time_ns if slip_ns is None else slip_ns
        self._border = np.full(count, np.inf) if border_m is None else border_m
        self._rest_s, self._rest_s_at = rest_s, rest_s_at
        self._steeper_rad, self._at_rest, self._delay_s = steeper_rad, at_rest, delay_s
        self._evened = evened
        self._plate = attitude(0.0)
        self._contact = self._contact_with(self._plate)
        self._inertial = self._inertial_on(self._plate)
        self._plain = _load(self._contact, self._inertial)
        self._earlier = Latest(self._delayed, ("delay_s",))
        self._leaning = Latest(self._leans, LEANING)
        self._latest = Latest(self._loads, LOADING)

    def __len__(self) -> int:
        return len(self.time_ns)

    def tilted(self, tilt_rad: Array | float) -> Moments:
        """Returns the same moments on a plate with a reported tilt of `tilt_rad` (n,)."""
        other = copy.copy(self)
        reported = self._contact.tilt_rad - self._steeper_rad
        other._steeper_rad = tilt_rad - reported
        other._rest_s = self._contact.rest_s if self._rest_s_at is None else self._rest_s_at(tilt_rad)
        steep = reported + other._steeper_rad
        other._contact = self._contact.changed(tilt_rad=steep, rest_s=np.maximum(other._rest_s, LEAST_REST_S))
        other._plain = _load(other._contact, other._inertial)
        other._leaning = Latest(other._leans, LEANING)
        other._latest = Latest(other._loads, LOADING)
        return other

    def again(self, changed: Changed) -> Moments:
        """Returns the moments of runs redone as `changed` says, on a plate that moves as recorded but for that."""
        rows, way, swifter = changed.rows, changed.way, changed.swifter
        time_ns, since = self.time_ns[rows], self._plate.tilt_rad[rows]
        slid_ns = np.round((time_ns - self._slip_ns[rows]) / swifter).astype(np.int64)
        steeper = self._steeper_rad
        toward = self._plate.down_rad[rows] + changed.turn_rad + changed.off_rad
        speed = np.hypot(self._velocity[rows, 0], self._velocity[rows, 1]) * swifter
        return Moments(
            time_ns=time_ns,
            run=changed.run,
            facts=changed.facts,
            attitude=lambda delay_s: self._attitude(delay_s).again(
                rows, turn_rad=changed.turn_rad, faster=changed.faster, since=since
            ),
            place_m=turned(self._place[rows] - changed.from_m, way) + changed.to_m,
            yaw_rad=self._yaw[rows] + changed.yaw_rad,
            velocity_m_s=np.column_stack([speed * np.cos(toward), speed * np.sin(toward)]),
            moving=self._moving[rows],
            slip_ns=time_ns - slid_ns,
            border_m=self._border[rows],
            rest_s=changed.rest_s,
            at_rest=self._at_rest,
            steeper_rad=steeper[rows] if isinstance(steeper, np.ndarray) else steeper,
            delay_s=self._delay_s,
        )

    @property
    def reported(self) -> Contact:
        """The contact with the attitude as the arm reported it, steepened by `steeper_rad`."""
        return self._contact

    @property
    def plain(self) -> Load:
        """The loads with the attitude as reported, and no push."""
        return self._plain

    def standing(self, model: Model) -> Contact:
        """Returns the contact as reported, by the model's delay earlier."""
        return self._contact_with(self._earlier(model)[0]) if model.acting("delay_s") else self._contact

    def loads(self, model: Model) -> Load:
        """Returns the contact and its loads with the model's attitude, delay and pushes."""
        return self._latest(model)

    def _loads(self, model: Model) -> Load:
        load = self._leaning(model)
        if not model.acting("push"):
            return load
        push = model.push(load.still if self._at_rest else load.contact)
        return Load(load.contact, load.tangential + push[:, :2], np.maximum(load.normal - push[:, 2], LEAST_M_S2))

    def _leans(self, model: Model) -> Load:
        """Returns the contact and its loads with the model's attitude and delay, and without its pushes."""
        plate, load, inertial = self._plate, self._plain, self._inertial
        if model.acting("delay_s"):
            plate, inertial = self._earlier(model)
            load = _load(self.standing(model), inertial)
        if model.acting("motion"):
            rate, acceleration = model.motion(load.contact)
            if self._evened is not None:
                acceleration = load.contact.acceleration_rad_s2 + self._evened(model)
            inertial = self._inertial_on(replace(plate, rate_rad_s=rate, acceleration_rad_s2=acceleration))
            load = _load(load.contact.changed(rate_rad_s=rate, acceleration_rad_s2=acceleration), inertial)
        if model.acting("attitude"):
            load = _load(_turned(load.contact, model.attitude(load.contact)), inertial)
        return load

    def _delayed(self, model: Model) -> tuple[Attitude, Array]:
        """Returns the plate by the model's delay earlier, and the inertial part of the loads (n, 3)."""
        plate = self._attitude(self._delay_s(model))
        return plate, self._inertial_on(plate)

    def _inertial_on(self, plate: Attitude) -> Array:
        """Returns the inertial part of the loads by the plate's own motion (n, 3), m/s²; zeros (3,) with `at_rest`."""
        return np.zeros(3) if self._at_rest else fictitious(plate, self._place, self._velocity)

    def _contact_with(self, plate: Attitude) -> Contact:
        facts, run = self._facts, self.run
        speed = np.hypot(self._velocity[:, 0], self._velocity[:, 1])
        way = np.arctan2(self._velocity[:, 1], self._velocity[:, 0])
        since = np.where(self._moving, self._slip_ns, self.time_ns) - facts.rest_ns[run]
        return Contact(
            run=facts.number[run],
            moving=self._moving,
            way_rad=np.where(self._moving, way, plate.down_rad),
            speed_m_s=np.where(self._moving, speed, 0.0),
            x_m=self._place[:, 0],
            y_m=self._place[:, 1],
            yaw_rad=self._yaw,
            rest_s=np.maximum(since * 1e-9 if self._rest_s is None else self._rest_s, LEAST_REST_S),
            slid_s=np.where(self._moving, np.maximum((self.time_ns - self._slip_ns) * 1e-9, 0.0), 0.0),
            tilt_rad=plate.tilt_rad + self._steeper_rad,
            down_rad=plate.down_rad,
            rate_rad_s=plate.rate_rad_s,
            acceleration_rad_s2=plate.acceleration_rad_s2,
            rising=plate.rising,
            gone_rad=plate.gone_rad,
            swing_rad=plate.swing_rad,
            step_s=plate.step_s,
            mount_rad=facts.mount_rad[run],
            mass_kg=facts.mass_kg[run],
            area_m2=facts.area_m2[run],
            border_m=self._border,
            temperature_c=facts.temperature_c[run],
            relative_humidity=facts.relative_humidity[run],
            spare_m_s2=np.full(len(run), np.nan),
        )


def _load(contact: Contact, inertial: Array) -> Load:
    """Returns the loads by gravity at the contact's tilt and by inertial forces per mass (n, 3 or 3)."""
    pull, down = contact.pulling_m_s2, contact.down
    tangential = np.array([pull * down[:, 0], pull * down[:, 1]]).T + inertial[..., :2]
    normal = contact.pressing_m_s2 - inertial[..., 2]
    return Load(contact, tangential, np.maximum(normal, LEAST_M_S2))


def still(contact: Contact) -> Contact:
    """Returns the contact on a plate that does not move."""
    none = np.zeros((len(contact), 3))
    return contact.changed(rate_rad_s=none, acceleration_rad_s2=none)


def _turned(contact: Contact, turn: Array) -> Contact:
    """Returns the contact on a plate turned by small rotation vectors (n, 3), in P, from the reported attitude."""
    x, y, z = contact.gravity.T
    # The plate turns by +w, so what is fixed in the world, such as gravity, turns by −w as the plate sees it.
    turn_x, turn_y, turn_z = turn.T
    new_x, new_y, new_z = x - turn_y * z + turn_z * y, y - turn_z * x + turn_x * z, z - turn_x * y + turn_y * x
    new_down = np.arctan2(new_y, new_x)
    return contact.changed(
        tilt_rad=np.arctan2(np.hypot(new_x, new_y), -new_z),
        down_rad=new_down,
        way_rad=np.where(contact.moving, contact.way_rad, new_down),
    )
