"""Flags of samples, and the error of an exact onset: those who write samples and those who read them share these."""

from __future__ import annotations

NO_TILT = "no_tilt"
"""The plate did not turn in this run, and the block was thrown or slid all the same: the run has no onset."""

UNRESOLVED = "onset_unresolved"
"""The slide could not be fitted: its onset lies somewhere within the tilt step in which it was detected."""

EXACT_RAD = 1e-9
"""The error that a simulated onset states, as it is known and not read: 0 stands for one that could not be fitted."""
