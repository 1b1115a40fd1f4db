"""The contact at chosen moments of a recording, and the loads that a model sees there."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from station.diagnosis.observations.driving import fictitious
from station.diagnosis.observations.plate import Attitude, Times
from station.physics.contact import GRAVITY_M_S2, Array, Bools, Contact
from station.physics.effect import Effect
from station.physics.model import Model

LEAST_REST_S = 1e-3
LOADING = ("attitude", "delay_s", "push")
"""The methods of an effect through which it changes how a block is loaded."""

Loading = tuple[tuple[Effect, tuple[tuple[str, float], ...]], ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class RunFacts:
    """What is known of each run (r,): see `Contact` for the meaning; `rest_ns` is when the block came to rest."""

    number: Array
    rest_ns: Times
    mount_rad: Array
    mass_kg: Array
    area_m2: Array
    temperature_c: Array
    relative_humidity: Array


@dataclass(frozen=True, eq=False)
class Load:
    """A contact as a model sees it, and what pulls and presses there: `tangential` (n, 2), `normal` (n,), m/s²."""

    contact: Contact
    tangential: Array
    normal: Array


class Moments:
    """n moments: when, in which run, and where the block was; `attitude` gives the plate's a delay (s) earlier.

    `at_rest` where the plate's own motion is not to pull: an onset that is read by tracing a slide back says what the
    slide's friction was, not what the load of its very moment; and `steeper_rad` (n,) is how much more than reported
    the plate would be tilted if it stood still and loaded the block as it did. `rested_s` (n,), where it is given,
    stands for the time at rest, and `rested_at` says what it would be at other tilts (n,). Both have to be what the
    protocol made of it: the time up to the slip itself is longer where friction happens to be high, and friction would
    seem to grow with it.
    """

    def __init__(
        self,
        *,
        time_ns: Times,
        run: Times,
        facts: RunFacts,
        attitude: Callable[[float], Attitude],
        place_m: Array,
        yaw_rad: Array,
        velocity_m_s: Array,
        moving: Bools,
        slip_ns: Times,
        border_m: Array,
        rested_s: Array | None = None,
        rested_at: Callable[[Array | float], Array] | None = None,
        at_rest: bool = False,
        steeper_rad: Array | float = 0.0,
    ) -> None:
        self.time_ns, self.run = time_ns, run
        self._facts, self._attitude = facts, attitude
        self._place, self._yaw, self._velocity = place_m, yaw_rad, velocity_m_s
        self._moving, self._slip_ns, self._border, self._rested = moving, slip_ns, border_m, rested_s
        self._rested_at = rested_at
        self._steeper_rad = steeper_rad
        self._at_rest = at_rest
        self._plate = attitude(0.0)
        self._contact = self._contact_with(self._plate)
        self._last: tuple[Loading, Load] | None = None

    def __len__(self) -> int:
        return len(self.time_ns)

    def tilted(self, tilt_rad: Array | float) -> Moments:
        """The same moments on a plate that is reported to be tilted so far (n,)."""
        other = copy.copy(self)
        reported = self._contact.tilt_rad - self._steeper_rad
        other._steeper_rad = tilt_rad - reported
        other._rested = self._contact.rest_s if self._rested_at is None else self._rested_at(tilt_rad)
        steep = reported + other._steeper_rad
        other._contact = replace(self._contact, tilt_rad=steep, rest_s=np.maximum(other._rested, LEAST_REST_S))
        other._last = None
        return other

    @property
    def reported(self) -> Contact:
        """The contact with the attitude as the arm reported it."""
        return self._contact

    @property
    def velocity_m_s(self) -> Array:
        """Of the block in P (n, 2)."""
        return self._velocity

    def loads(self, model: Model) -> Load:
        """The contact and the loads with the model's attitude, delay and pushes.

        Several channels ask in turn, and most models that are compared differ in their friction alone.
        """
        key = _loading(model)
        if self._last is None or self._last[0] != key:
            self._last = (key, self._loads(model))
        return self._last[1]

    def _loads(self, model: Model) -> Load:
        delay = model.delay_s()
        plate = self._plate if delay == 0 else self._attitude(delay)
        contact = self._contact if delay == 0 else self._contact_with(plate)
        if model.acting("attitude"):
            contact = _turned(contact, model.attitude(contact))
        pulled = _still(contact) if self._at_rest else contact
        push = model.push(pulled)
        inertial = np.zeros((len(self), 3)) if self._at_rest else fictitious(plate, self._place, self._velocity)
        down = np.column_stack([np.cos(contact.down_rad), np.sin(contact.down_rad)])
        tangential = GRAVITY_M_S2 * np.sin(contact.tilt_rad)[:, None] * down + inertial[:, :2] + push[:, :2]
        normal = GRAVITY_M_S2 * np.cos(contact.tilt_rad) - inertial[:, 2] - push[:, 2]
        return Load(contact, tangential, np.maximum(normal, 1e-3))

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
            rest_s=np.maximum(since * 1e-9 if self._rested is None else self._rested, LEAST_REST_S),
            slid_s=np.where(self._moving, np.maximum((self.time_ns - self._slip_ns) * 1e-9, 0.0), 0.0),
            tilt_rad=plate.tilt_rad + self._steeper_rad,
            down_rad=plate.down_rad,
            rate_rad_s=plate.rate_rad_s,
            acceleration_rad_s2=plate.acceleration_rad_s2,
            rising=plate.rising,
            step_s=plate.step_s,
            mount_rad=facts.mount_rad[run],
            mass_kg=facts.mass_kg[run],
            area_m2=facts.area_m2[run],
            border_m=self._border,
            temperature_c=facts.temperature_c[run],
            relative_humidity=facts.relative_humidity[run],
        )


def _loading(model: Model) -> Loading:
    """The terms through which a model changes contact and loads, and their values."""
    acting = (term for hook in LOADING for term in model.acting(hook))
    return tuple((term.effect, tuple(term.values.items())) for term in acting)


def _still(contact: Contact) -> Contact:
    still = np.zeros((len(contact), 3))
    return replace(contact, rate_rad_s=still, acceleration_rad_s2=still)


def _turned(contact: Contact, turn: Array) -> Contact:
    """The contact on a plate that is turned by small rotation vectors (n, 3), in P, from the reported attitude."""
    tilt, down = contact.tilt_rad, contact.down_rad
    gravity = np.column_stack([np.sin(tilt) * np.cos(down), np.sin(tilt) * np.sin(down), -np.cos(tilt)])
    # The plate turns by +w, so what is fixed in the world turns by −w as the plate sees it.
    gravity = gravity - np.cross(turn, gravity)
    gravity /= np.linalg.norm(gravity, axis=1, keepdims=True)
    new_down = np.arctan2(gravity[:, 1], gravity[:, 0])
    return replace(
        contact,
        tilt_rad=np.arctan2(np.hypot(gravity[:, 0], gravity[:, 1]), -gravity[:, 2]),
        down_rad=new_down,
        way_rad=np.where(contact.moving, contact.way_rad, new_down),
    )
