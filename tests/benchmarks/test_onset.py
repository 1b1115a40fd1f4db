"""The fitted onset beside the paper's threshold rule, on exact slides: how late each is, and how sure."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.unit.friction.slides import measure, slide

pytestmark = pytest.mark.benchmark
RUNS = 40


@pytest.mark.parametrize("drop", [0.0, 0.2])
def test_the_fit_is_closer_than_the_threshold(drop: float, capsys: pytest.CaptureFixture[str]) -> None:
    """Prints mean ± sd in degrees; the rule's tilt is the mean of the 300 ms before it fires, as the paper takes it."""
    lines = [f"kinetic drop {drop:.0%}: error of the onset, mean ± sd (degrees)", "  deg/s    rule, 300 ms         fit"]
    for rate_deg_s in (1.0, 2.0, 5.0, 10.0):
        rng = np.random.default_rng(1)
        rule: list[float] = []
        fit: list[float] = []
        for onset_rad in rng.uniform(math.radians(12), math.radians(28), RUNS):
            truth = slide(float(onset_rad), rate_deg_s=rate_deg_s, drop=drop)
            seen = measure(truth, noise_px=0.1, sag_px=12, rng=rng)
            assert seen is not None
            fired = truth.detection_s(sag_px=12)
            averaged = (truth.time_s > fired - 0.3) & (truth.time_s <= fired)
            rule.append(math.degrees(truth.tilt_rad[averaged].mean() - onset_rad))
            fit.append(math.degrees(seen.angle_rad - onset_rad))
        lines.append(
            f"  {rate_deg_s:5.1f}  {np.mean(rule):+.3f} ± {np.std(rule):.3f}   {np.mean(fit):+.4f} ± {np.std(fit):.4f}"
        )
        assert np.sqrt(np.mean(np.square(fit))) < np.sqrt(np.mean(np.square(rule)))
    with capsys.disabled():
        print("\n" + "\n".join(lines))
