"""Vibration: the arm shakes the plate, and a block near its limit slips at a moment that the shaking chooses.

Let the load pass friction as r t, with a push a(t) of deviation s and cycle T beside it. A block slips while e = r t
+ a is positive, and until the integral of e is back at 0 (Newmark 1965). Where s << r T it goes when e first passes
0; the rate of that is r + a', and a and a' are uncorrelated: the push at the onset has the mean 0 and the scatter s.
Where s is about r T, what slips at a crest is stopped in the trough: the block creeps, and the slide that gets away
begins when the mean load has caught up, about at 0 and with less scatter. Where s >> r T a single slip is longer than
what counts as one, and starts near a crest (tests/unit/physics/test_shaken_block.py).

That is the moment of the slip. An onset, however, is read by tracing a slide back, and a slide is pushed to and fro: of
a tone of frequency f it keeps a velocity of s / ω at most. Steps of a block under three tones whose slides are read
over 0.15 s have, whatever s is to r T, the scatter s R with R = 1 / (1 + (ω t)^1.5), t = 0.05 s, and come early by
about 0.4 s √R (the same test: 1.5 to 28 Hz, 0.06 to 0.4 m/s²).

The push on a slide has no mean, but it begins alike, on a rising push. Of a Gaussian push that passes a level upwards
the slope is s ω times a Rayleigh variable, √(π/2) on average (Rice 1944); from its value p and slope p' the push goes
on as p ρ(t) − p' ρ'(t) / ω² on average (Slepian 1963, in Rosenblatt (ed.), Time Series Analysis, 104), with the push's
autocorrelation ρ. Tones keep together for about a cycle: the law has cos(ω t) and sin(ω t), both times
exp(−½ (f t / 0.85)²). A slide keeps the velocity √(π/2) s / ω of it, by which its path seems to have begun early.

The creep follows from the same steps. At a distance G = u s to the limit a Gaussian push passes it ω exp(−u²/2) / 2π
times a second (Rice 1944), by an amount e that is exponential with the mean s / u; while it is beyond, e falls as e −
ω² G t² / 2, and the slip, from the first zero of that to where its integral is back at 0, twice as far on the other
side, is 9 e² / (2 ω² G) long. With ⟨e²⟩ = 2 s² / u² the block creeps at the mean speed

    v = (s / ω) 9 exp(−u²/2) / (2π u³),

for a large u; 1 / ((1 + u) (1 + u + u²)) in place of 1 / u³ has the same limit, and is right within a fifth down to u =
0.4, beyond which slips run into each other (the same test). ω = 2π f, f the mean frequency of the shaking. G is the
distance to where the run's block gets away.

The scatter is s (1 + c cos(descent) + d sin(descent)): some poses of the arm are softer than others. c and d are
without meaning while s = 0; alike in all poses (c = d = 0) the mean is hardly more than another mu.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter

EARLY = 0.4
"""Mean of the push at the onset over the shaking's deviation, for slow shaking; see above.

A number of its own instead did not let fits converge: four shaken sessions of 100 runs gained -5, -2, 4 and 7 nats.
"""

TRACED_S = 0.05
"""The time t over which a traced slide averages shaking, s, and the power of (ω t) that it does so with."""
POWER = 1.5

KICK, FADES = float(np.sqrt(np.pi / 2.0)), 0.85
"""The slope of the push at the slip over s ω, and the cycles within which what follows from it fades to 0.6; see above.

A push that did not fade was absorbed by mu: a shaken arm of 0.2 m/s² was called a law of the rate, by 144 in twice the
log likelihood less."""

LEAST_M_S2 = 1e-9
"""A weaker shaking is none: it guards the division by it."""


class ArmVibration(Effect):
    """The plate shakes."""

    id: ClassVar[str] = "arm_vibration"
    title: ClassVar[str] = "vibration of the arm"
    law: ClassVar[str] = (
        "shaking s (1 + c cos + d sin of the descent): creep, and onsets that scatter and come early (s = 0)"
    )
    source: ClassVar[str] = (
        "Newmark 1965, Géotechnique 15, 139 (slips at crests); Rice 1944, Bell Syst. Tech. J. 23, 282 (crossings); "
        "Capozza et al. 2009, PRL 103, 085502 (lowered threshold)"
    )
    layer: ClassVar[Layer] = "rig"
    family: ClassVar[Family] = "timing"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        # The creep has no slope at the null: it sets in where the shaking comes near to the limit.
        Parameter(name="sd_m_s2", symbol="s", unit="m/s²", low=0.0, high=2.0, typical=0.1, sizes=(0.1, 0.05)),
        Parameter(
            name="cos1", symbol="c", unit="1", low=-0.7, high=0.7, typical=0.3, null=None, starts=(0.0, 0.6, -0.6)
        ),
        Parameter(
            name="sin1", symbol="d", unit="1", low=-0.7, high=0.7, typical=0.3, null=None, starts=(0.0, 0.6, -0.6)
        ),
        Parameter(name="tone_hz", unit="Hz", low=1.0, high=100.0, typical=10.0, null=None, starts=(10.0,)),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("pivot_offset", "one_way_friction", "plate_anisotropy", "presliding")
    separated_by: ClassVar[str] = "the same tilts from other poses of the arm, or an IMU on the plate"

    def push(self, contact: Contact, values: Values) -> Array | None:
        """Returns the mean push (n, 3), m/s², in P, down the slope."""
        mean = _course(np.where(contact.moving, contact.slid_s, 0.0), values) * _deviation(contact, values)
        return np.column_stack([mean[:, None] * contact.down, np.zeros(len(contact))])

    def creep(self, contact: Contact, values: Values) -> Array | None:
        """Returns the mean velocity (n, 2), m/s, of a block that slips at crests and is stopped in troughs."""
        sd = _deviation(contact, values)
        apart = np.maximum(contact.spare_m_s2, 0.0) / np.maximum(sd, LEAST_M_S2)
        slips = 9.0 * np.exp(-0.5 * apart**2) / ((1.0 + apart) * (1.0 + apart + apart**2)) / (2.0 * np.pi)
        speed = np.where(contact.moving, 0.0, sd * slips / (2.0 * np.pi * values["tone_hz"]))
        return speed[:, None] * contact.down

    def shaking(self, contact: Contact, values: Values) -> Array | float:
        """Gives the standard deviation (n,), m/s², of the random push as a traced onset shows it."""
        return _kept(values) * _deviation(contact, values)


def _course(slid_s: Array, values: Values) -> Array:
    """Returns the mean push (n,) `slid_s` (n,) after the slip, over the shaking's deviation."""
    cycles = values["tone_hz"] * slid_s
    begun, rising = EARLY * np.sqrt(_kept(values)) * np.cos(2.0 * np.pi * cycles), KICK * np.sin(2.0 * np.pi * cycles)
    return (begun + rising) * np.exp(-0.5 * (cycles / FADES) ** 2)


def _deviation(contact: Contact, values: Values) -> Array:
    """Returns the standard deviation (n,) of the shaking, m/s²."""
    wave = values["cos1"] * contact.down[:, 0] + values["sin1"] * contact.down[:, 1]
    return np.asarray(values["sd_m_s2"] * (1.0 + wave))


def _kept(values: Values) -> float:
    """Returns the share R of the shaking's deviation by which traced onsets scatter."""
    return float(1.0 / (1.0 + (2.0 * np.pi * values["tone_hz"] * TRACED_S) ** POWER))
