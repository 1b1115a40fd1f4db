"""The vectors that the integrator reads and writes have a place for each number."""

from __future__ import annotations

# The places of the state vector.
T, X, Y, YAW, VX, VY, SPIN = range(7)
AGE, SLIP, TIRED = 7, 8, 9
PLAY, ANGLE, RATE, SEEN, SEEN_RATE = 10, 11, 12, 13, 14
AT_X, AT_Y, AT_YAW, HELD = 15, 16, 17, 18
SLOSH_X, SLOSH_Y, SLOSH_VX, SLOSH_VY = 19, 20, 21, 22
PULL_X, PULL_Y, MEASURED, MEASURED_RATE, FRESH, WEAKEST = 23, 24, 25, 26, 27, 28
AX, AY, TURNING = 29, 30, 31  # accelerations, as a millisecond smooths them
SIZE = 32

# The places of a motion: begin (s), duration (s), azimuth (rad), six coefficients of the angle's polynomial.
BEGIN, LASTS, AZIMUTH, POLYNOMIAL = 0, 1, 2, 3
