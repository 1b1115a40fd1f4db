"""Planar simulator and MuJoCo on every effect, for more runs and sizes than the contract has; and what a run costs.

`pytest -m benchmark -s tests/benchmarks/test_simulators_agree.py` prints the tables.
"""

from __future__ import annotations

import time

import numpy as np
import pytest

from station.physics.catalogue import catalogue
from station.physics.model import Model
from station.simulators.mujoco.batch import simulate as in_mujoco
from station.simulators.planar.commands import Commands, ramps
from station.simulators.planar.simulate import Chances
from station.simulators.planar.simulate import simulate as in_plane
from tests.contracts.simulated_runs import MU, apart, chances_for, commands_for, stamps_of, typical

pytestmark = pytest.mark.benchmark
EFFECTS = catalogue()
SHARES = (0.5, 1.0, 2.0)
RUNS = 12


def test_agreement_by_effect_and_size() -> None:
    print(
        f"\n{'effect':20s}  size  onsets apart [deg]: median, most    paths apart [mm]: median, most    runs that slid"
    )
    for name, effect in EFFECTS.items():
        for share in SHARES:
            commands = commands_for(effect, RUNS)
            of, chances, stamps = typical(effect, size=share), chances_for(commands), stamps_of(commands)
            both = (each(commands, of, time_s=stamps, chances=chances) for each in (in_plane, in_mujoco))
            found = apart(*both)
            known = found.onset_deg[np.isfinite(found.onset_deg)]
            onsets = f"{np.median(known):.3f} {known.max():.3f}" if len(known) else "(none slid)"
            one_only = int(np.isinf(found.onset_deg).sum())
            also = f"  {one_only} in one simulator only" if one_only else ""
            print(
                f"{name:20s} {share:5.2f}  {onsets:>20s}  {np.median(found.path_mm):20.3f} {found.path_mm.max():.3f}"
                f"  {int((found.length_mm > 0.1).sum()):10d}{also}"
            )


def session(count: int) -> Commands:
    """Tilts in 27 steps of 1.35° at 10 °/s with holds of 0.5 s, in turns to four directions, until 36°."""
    times, angles = [0.0], [0.0]
    for step in range(27):
        times += [times[-1] + 0.135, times[-1] + 0.635]
        angles += [np.radians(1.35 * (step + 1))] * 2
    turn = np.arange(count) % 4 * np.pi / 2
    return ramps(times, [angles], downhill_rad=turn, border_m=0.045, run=np.arange(float(count)))


@pytest.mark.parametrize("name", ["plain", "plate_anisotropy", "contact_aging"])
def test_seconds_a_run(name: str) -> None:
    count = 200
    of = Model(mu_s=MU) if name == "plain" else typical(EFFECTS[name])
    chances = Chances.drawn(count, scatter=0.1, rng=np.random.default_rng(1))
    commands = session(count)
    began, wall = time.process_time(), time.perf_counter()
    motions = in_mujoco(commands, of, chances=chances)
    spent, waited = time.process_time() - began, time.perf_counter() - wall
    exact = in_plane(commands, of, chances=chances)
    off = np.degrees(motions.onset_rad - exact.onset_rad)
    print(
        f"\n{name}: {count} runs of {commands.end_s[0]:.0f} s in {spent:.1f} s of processor time ({waited:.1f} s), "
        f"{1e3 * spent / count:.0f} ms a run; onsets apart by {np.nanmedian(np.abs(off)):.4f}° in the median, "
        f"{np.nanmax(np.abs(off)):.3f}° at most"
    )
