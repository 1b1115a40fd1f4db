"""The flags of samples that both those who write recordings and those who read them know."""

from __future__ import annotations

NO_TILT = "no_tilt"
"""The plate did not turn in this run, and the block was thrown or slid all the same: the run has no onset."""
