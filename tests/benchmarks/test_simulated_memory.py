"""The memory that simulating a session takes; `pytest -m benchmark -s` prints it.

The session is as bad as a recording may ask for: one run that lasts as long as a batch of runs may, by its last event,
although nothing was recorded for most of it. Each model is simulated in a process of its own, because memory that was
once taken is not given back.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from shared.config import table_of
from shared.rig import rig_of_table
from station.physics.catalogue import catalogue
from station.physics.model import Model, Term
from station.recording.arrays import load_signals
from station.recording.reader import open_recording
from station.signals.session import Signals
from station.simulators.planar.batches import KNOT_S, MOST_KNOTS
from station.simulators.planar.session import repeated
from station.simulators.recorded_runs import recorded_runs
from tests.fuzz.trial import peak_bytes

pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(1800)]

GOLDEN = Path(__file__).parents[1] / "golden" / "session.mcap"
MODELS: Mapping[str, Mapping[str, Mapping[str, float]]] = {
    "friction alone": {},
    "a delay": {"clock_offset": {"delay_s": 0.01}},
    "two effects on the attitude": {"platform_level": {"eps_x_rad": 0.01}, "backlash": {"half_width_rad": 0.003}},
}
MOST_MB = 1000.0


def long_session() -> Signals:
    """The golden session, whose last run ends as late as it may."""
    recorded = load_signals(open_recording(GOLDEN))
    begin_ns = recorded_runs(recorded)[-1].begin_ns
    ends = recorded.events.time_ns.copy()
    ends[-1] = begin_ns + round(MOST_KNOTS * KNOT_S * 1e9)
    return replace(recorded, events=replace(recorded.events, time_ns=ends))


def measure(effects: Mapping[str, Mapping[str, float]]) -> tuple[float, float]:
    """The largest memory of this process in MB, before the simulation and after it."""
    recorded, known = long_session(), catalogue()
    rig = rig_of_table(table_of(open_recording(GOLDEN).attachments["rig.toml"], "rig.toml"))
    terms = tuple(Term(known[name], {**known[name].neutral(), **values}) for name, values in effects.items())
    before = peak_bytes() / 1e6
    repeated(recorded, Model(mu_s=0.3464, terms=terms), rig=rig)
    return before, peak_bytes() / 1e6


def test_simulating_takes_less_than_a_gigabyte() -> None:
    context = multiprocessing.get_context("spawn")
    for name, effects in MODELS.items():
        with context.Pool(1) as pool:
            before, after = pool.apply(measure, (effects,))
        print(f"\n{name}: {after:.0f} MB, {before:.0f} before; {1e6 * (after - before) / MOST_KNOTS:.0f} bytes a knot")
        assert after < MOST_MB
