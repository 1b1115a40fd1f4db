"""The plan that a recording carries is the plan that was used."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shared.errors import UserError
from shared.possible import LARGEST, LEAST
from station.app.recordings import plan_toml
from station.sampling.angles import AngleRange
from station.sampling.plan import (
    MOST_FRAMES,
    MOST_STEPS,
    DirectionPlan,
    DwellPlan,
    Plan,
    ReferencePlan,
    SlipPlan,
    TiltPlan,
    load_plan,
)

POSITIVE = st.floats(min_value=LEAST, max_value=LARGEST)
COUNT = st.integers(min_value=1, max_value=10**9)
FREE = st.floats(min_value=-LARGEST, max_value=LARGEST)


def dwell(bounds: tuple[float, float]) -> DwellPlan:
    return DwellPlan(min_s=min(bounds), max_s=max(bounds))


PLANS: st.SearchStrategy[Any] = st.builds(
    Plan,
    samples=COUNT,
    seed=st.integers(min_value=0, max_value=2**62),
    timeout_s=POSITIVE,
    silence_s=POSITIVE,
    faults=COUNT,
    reference=st.builds(
        ReferencePlan, frames=st.integers(min_value=2, max_value=MOST_FRAMES), noise_limit_px=POSITIVE, attempts=COUNT
    ),
    tilt=st.builds(
        TiltPlan,
        steps=st.integers(min_value=1, max_value=MOST_STEPS),
        max_deg=st.floats(min_value=1e-6, max_value=89.999),
        adapt_after=st.integers(min_value=0, max_value=99),
        adapt_sd=POSITIVE,
        rate_deg_s=POSITIVE,
        return_rate_deg_s=POSITIVE,
        hold_s=POSITIVE,
    ),
    slip=st.builds(
        SlipPlan,
        corners=st.integers(min_value=1, max_value=4),
        base_px=POSITIVE,
        per_deg_px=FREE,
        average_s=POSITIVE,
        settle_s=FREE,
        rest_px=FREE,
        rest_s=FREE,
        rest_timeout_s=FREE,
    ),
    dwell=st.tuples(POSITIVE, POSITIVE).map(dwell),
    direction=st.builds(
        DirectionPlan,
        mode=st.sampled_from(["four", "free"]),
        some=st.lists(st.integers(min_value=0, max_value=3), min_size=1, max_size=4).map(tuple),
        distance_power=POSITIVE,
        min_slide_px=FREE,
    ),
)


def reread(text: str) -> Plan:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "plan.toml"
        file.write_text(text, encoding="utf-8")
        return load_plan(file)


@given(PLANS)
@settings(max_examples=100, deadline=None)
def test_any_plan_comes_back_as_it_was(plan: Plan):
    assert reread(plan_toml(plan)) == plan


def test_the_papers_plan_comes_back_as_it_was():
    assert reread(plan_toml(Plan())) == Plan()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("seed = -1\n", "seed >= 0, got .*-1"),
        ("faults = 0\n", "faults >= 1"),
        ("silence_s = 0\n", "silence_s > 0"),
        ("timeout_s = inf\n", "finite number of at most .* for 'timeout_s', got inf"),
        ("[tilt]\nrate_deg_s = nan\n", r"\[tilt\].*finite number of .* for 'rate_deg_s', got nan"),
        ("[dwell]\nmax_s = inf\n", r"\[dwell\].*finite number of .* for 'max_s'"),
        ("[tilt]\nhold_s = -1.0\n", "hold_s of 0 or more"),
        ("[direction]\ndistance_power = -1.0\n", "distance_power >= 0"),
        ("[direction]\nsome = [4]\n", "directions 0, 1, 2 and 3"),
        ("[tilt]\nsteps = 1000000000\n", "steps of 1 to 9000, got 1000000000"),
        ("[reference]\nframes = 1000000000\n", "frames of 2 to 10000, .* got 1000000000"),
        ("samples = 1000000000000\n", "at most .* for 'samples', got 1000000000000"),
        ("[slip]\naverage_s = 1e300\n", "at most .* for 'average_s', got 1e.300"),
        ("[slip]\nper_deg_px = -1e300\n", "at most .* for 'per_deg_px', got -1e.300"),
        ("[tilt]\nrate_deg_s = 1e-323\n", "rates of .* or more"),
        ("[tilt]\nrates_deg_s = [5.0, 1e300]\n", "at most .* for 'rates_deg_s', got 1e.300"),
        ("[tilt]\nrates_deg_s = [5.0, 1e-323]\n", "expected rates_deg_s of .* or more"),
    ],
)
def test_a_plan_that_would_fail_later_is_refused_at_once(text: str, said: str):
    with pytest.raises(UserError, match=said):
        reread(text)


def test_one_sample_has_no_spread_to_narrow_by():
    angles = AngleRange(TiltPlan(adapt_after=1))
    angles.add(0, 0.3)
    assert all(math.isfinite(angle) for angle in angles.steps_rad(0, limit_rad=1.0))
