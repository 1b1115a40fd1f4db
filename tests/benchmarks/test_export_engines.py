"""The engines are compared with what was measured; run with `pytest -m benchmark -s` and this file.

For each engine that is installed: the exported file, a tilt test at 2°/s, the angle by direction. `creep` is how far
the object has moved half a degree before it should.
"""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path

import numpy as np
import pytest

from tests.recovery.engines import engines
from tests.recovery.engines.tilt import onset
from tests.unit.export.pairs import PAIRS, exported

DIRECTIONS = 24
SLOW = {"PhysX": 8}
"""Engines whose Python takes ten seconds a direction."""


@pytest.mark.benchmark
@pytest.mark.parametrize("stem", PAIRS)
@pytest.mark.parametrize("name", sorted(engines()))
def test_deviation_by_direction(name: str, stem: str, tmp_path: Path) -> None:
    engine, pair = engines()[name], PAIRS[stem]
    if importlib.util.find_spec(engine.MODULE) is None:
        pytest.skip(f"{name} is not installed ({engine.MODULE})")
    if not pair.isotropic and name == "DART":
        pytest.skip("its Python cannot set friction by direction")
    folder = exported(tmp_path, engine.FORMAT)
    count = SLOW.get(name, DIRECTIONS)
    print(f"\n{name}, {pair.name} (axes {pair.mu_1:g} and {pair.mu_2:g}, fixed in the {pair.fixed_in})")
    print(f"{'direction':>10} {'measured':>9} {'engine':>9} {'off':>7} {'creep mm':>9}")
    off: list[float] = []
    for direction in np.arange(count) * (2 * math.pi / count):
        wanted_rad = float(pair.angle_rad(direction))
        bench = engine.load(folder, stem)
        seen = onset(bench, float(direction), expected_rad=wanted_rad)
        bench.close()
        wanted, angle = math.degrees(wanted_rad), math.degrees(seen.angle_rad)
        crept_mm = seen.crept_m * 1e3
        off.append(angle - wanted)
        print(
            f"{math.degrees(direction):>10.0f} {wanted:>9.3f} {angle:>9.3f} {off[-1]:>+7.3f} {crept_mm:>9.3f}",
            flush=True,
        )
    rms = math.sqrt(float(np.mean(np.square(off))))
    print(f"{'all':>10} worst {max(off, key=abs):+.3f} deg, root mean square {rms:.3f} deg")
    assert np.isfinite(off).all()
