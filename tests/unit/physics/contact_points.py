"""A block that stands on many points, each with Coulomb friction of its own: what the laws of a sole are compared with.

It shares nothing with the laws: no limit surface, no resultant. The pressure is linear over the sole (a rigid block on
a soft layer, which never pulls) and balances gravity, friction, and the moment of friction about the mass:

    p_i = max(0, a + b · r_i),    Σ p_i = N,    Σ p_i (r_i − d) + h Σ f_i = 0,    f_i = −mu_i p_i v_i / |v_i|,

and x, y and yaw are integrated by Runge and Kutta's fourth-order rule.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from station.physics.contact import GRAVITY_M_S2, Array, Bools

POINTS = 12
ROUNDS = 30
STEP_S = 2e-3
STILL_M_S = 1e-9


@dataclass(frozen=True, kw_only=True)
class ManyPoints:
    """A square sole of `side_m` whose mass is `offset_m` (2,) off its middle and `height_m` above it.

    `gradient_per_m` (2,) is by how much friction grows over the sole, as a share of `mu`; a point's friction is in
    proportion to its pressure to the power 1 − `load_power`. All in the block's frame. `plate` gives the log of a
    factor (k,) on the friction at places (k, 2), m, on the plate.
    """

    mu: float
    side_m: float = 0.01
    height_m: float = 0.0
    offset_m: tuple[float, float] = (0.0, 0.0)
    gradient_per_m: tuple[float, float] = (0.0, 0.0)
    load_power: float = 0.0
    plate: Callable[[Array], Array] | None = None

    @property
    def places(self) -> Array:
        """The points (k, 2), m, from the middle of the sole."""
        line = ((np.arange(POINTS) + 0.5) / POINTS - 0.5) * self.side_m
        x, y = np.meshgrid(line, line)
        return np.column_stack([x.ravel(), y.ravel()])

    def coefficients(self) -> Array:
        """mu of each point (k,) at the mean pressure."""
        return self.mu * (1.0 + self.places @ np.array(self.gradient_per_m))

    def forces(self, ways: Array, normal_m_s2: float, places: Array) -> Array:
        """Friction (k, 2) per mass on points at places (k, 2) on the plate that slide along unit vectors (k, 2)."""
        plain = self.coefficients() * (1.0 if self.plate is None else np.exp(self.plate(places)))
        friction, active = plain, np.ones(len(plain), dtype=bool)
        for _ in range(ROUNDS):
            pressure = self._pressure(friction[:, None] * ways, normal_m_s2, active)
            relative = np.maximum(pressure, 1e-3 * pressure.max()) * len(plain) / normal_m_s2
            before, friction = friction, plain * relative**-self.load_power
            if pressure.min() >= 0.0 and np.allclose(friction, before, rtol=1e-6):
                return -(friction * pressure)[:, None] * ways
            active = active & (pressure > 0.0)
        raise RuntimeError(f"expected a pressure that balances, got none in {ROUNDS} rounds")

    def _pressure(self, pulled: Array, normal_m_s2: float, active: Bools) -> Array:
        """Returns the points' pressure (k,), 0 where the sole has lifted; `pulled`: each coefficient times its way."""
        basis = np.column_stack([np.ones(len(active)), self.places]) * active[:, None]
        arms = self.places - np.array(self.offset_m) - self.height_m * pulled
        solved = np.linalg.solve(np.vstack([basis.sum(axis=0), arms.T @ basis]), [normal_m_s2, 0.0, 0.0])
        return basis @ solved

    def slid(self, velocity: tuple[float, float, float], *, tilt_rad: float, yaw_rad: float, seconds: float) -> Array:
        """x, y of the mass and yaw (m, 3) every `STEP_S`, up to a stop; the plate slopes down along x."""
        state = np.array([0.0, 0.0, yaw_rad, *velocity])
        path = [state[:3].copy()]
        while len(path) * STEP_S <= seconds and np.hypot(*state[3:5]) > STEP_S * GRAVITY_M_S2:
            first = self._rates(state, tilt_rad)
            second = self._rates(state + 0.5 * STEP_S * first, tilt_rad)
            third = self._rates(state + 0.5 * STEP_S * second, tilt_rad)
            fourth = self._rates(state + STEP_S * third, tilt_rad)
            state = state + STEP_S / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)
            path.append(state[:3].copy())
        return np.array(path)

    def _rates(self, state: Array, tilt_rad: float) -> Array:
        c, s = np.cos(state[2]), np.sin(state[2])
        into_plate = np.array([[c, -s], [s, c]])
        arms = self.places - np.array(self.offset_m)
        turning = state[5] * np.column_stack([-arms[:, 1], arms[:, 0]])
        velocity = state[3:5] @ into_plate + turning
        ways = velocity / np.maximum(np.linalg.norm(velocity, axis=1, keepdims=True), STILL_M_S)
        force = self.forces(ways, GRAVITY_M_S2 * np.cos(tilt_rad), state[:2] + arms @ into_plate.T)
        moment = (arms[:, 0] * force[:, 1] - arms[:, 1] * force[:, 0]).sum()
        pulled = into_plate @ force.sum(axis=0) + [GRAVITY_M_S2 * np.sin(tilt_rad), 0.0]
        return np.array([*state[3:6], *pulled, moment / (self.side_m**2 / 6.0)])

    def holds(self, load_rad: float) -> float:
        """The largest T / N, in a direction of B through the mass, at which a flat block at rest stays there.

        It slips in the motion of the least dissipation per load (the upper bound theorem of plastic limit analysis).
        """
        arms = (self.places - np.array(self.offset_m)) / self.side_m
        share = self.coefficients() / len(arms)
        toward = np.array([np.cos(load_rad), np.sin(load_rad)])
        aside = np.array([-toward[1], toward[0]])

        def dissipated(motion: Array) -> float:
            turning = motion[1] * np.column_stack([-arms[:, 1], arms[:, 0]])
            return float(share @ np.linalg.norm(toward + motion[0] * aside + turning, axis=1))

        return float(
            minimize(dissipated, np.zeros(2), method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-9}).fun
        )

    def stands(self, tilt_rad: float, down_rad: float) -> bool:
        """True if a pressure that nowhere pulls balances a block that cannot slide."""
        lead = self.height_m * np.tan(tilt_rad) * np.array([np.cos(down_rad), np.sin(down_rad)])
        reach = 0.5 * self.side_m
        return bool(np.all(np.abs(np.array(self.offset_m) + lead) <= reach))
