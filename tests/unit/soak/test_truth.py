"""The comparison of samples with the truth finds what is false, and nothing else."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from shared.messages import Sample
from tests.golden.make import SESSION
from tests.soak import truth

SECOND = 1_000_000_000
KNOWN = truth.Truth(
    time_ns=np.arange(0, 101, dtype=np.int64) * SECOND,
    friction_rad=np.full(101, math.radians(20.0)),
    tilt_rad=np.radians(np.linspace(0.0, 50.0, 101)),
    place_m=np.zeros((101, 2)),
)
"""A plate that tilts by half a degree a second, and a block of 20 degrees."""


def told(run: int, onset_deg: float = 20.0, **more: object) -> Sample:
    sample = Sample(
        run=run,
        slip_ns=round(2 * onset_deg * SECOND),
        detect_ns=round(2 * onset_deg * SECOND) + 1,
        onset_angle_rad=math.radians(onset_deg),
        onset_sigma_rad=math.radians(0.01),
    )
    return replace(sample, **more)  # pyright: ignore[reportArgumentType]


def test_true_samples_are_found_true(capsys: pytest.CaptureFixture[str]) -> None:
    assert truth.judged(KNOWN, [told(1, 20.01), told(2, 19.99), told(3, 20.0), told(4, 20.02)]) == 0
    said = capsys.readouterr().out
    assert "off: 0 of 4 (0.00% to 48.99%)" in said
    assert "robust sd 1.48" in said


@pytest.mark.parametrize(
    "false",
    [
        told(2, 25.0),
        told(2, 19.0),
        told(2, onset_angle_rad=math.radians(20.05), slip_ns=30 * SECOND),
        told(2, 33.0, censored=True, slip_ns=0),
        told(1, 20.0),
    ],
    ids=["held by something", "read early", "a tilt that never was", "held beyond its friction", "a run twice"],
)
def test_a_false_sample_is_found(false: Sample) -> None:
    assert truth.judged(KNOWN, [told(1), false]) == 1


@pytest.mark.parametrize(
    "sample",
    [
        told(2, 25.0, flags=("disturbed_foam",)),
        told(2, 33.0, censored=True, slip_ns=0, flags=("disturbed_foam",)),
        told(2, 15.0, censored=True, slip_ns=0),
    ],
    ids=["held by the foam", "held by the foam to the end", "held below its friction"],
)
def test_what_does_not_count_and_what_is_true_is_not(sample: Sample) -> None:
    assert truth.judged(KNOWN, [told(1), sample]) == 0


def test_a_good_sample_that_a_flag_lost_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    truth.judged(KNOWN, [told(1), told(2, flags=("disturbed_foam",)), told(3, 30.0, flags=("disturbed_foam",))])
    assert "; 1 of them right" in capsys.readouterr().out


def test_a_session_without_truth_is_refused_in_words(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        truth.main([str(SESSION)])
    assert "expected a simulated session" in capsys.readouterr().err
