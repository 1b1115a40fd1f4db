"""The soak finds what grows and what is missing."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import psutil
import pytest

from station.recording.reader import open_recording
from tests.soak import __main__ as soak
from tests.soak.watching import Reading, growth, readings, slope
from tests.unit.recording.test_parts import split


def told(memory: float, count: int = 40) -> list[Reading]:
    return [Reading(float(at), 100 + memory * at, 9, 3, at) for at in range(count)]


def test_what_grows_is_found_and_what_is_recorded_may() -> None:
    assert growth(told(1.0), "memory_mb") == (115.0, 135.0)
    assert soak.grown(told(1.0)) == 1
    assert soak.grown(told(0.0)) == 0


def test_the_slope_comes_with_its_interval() -> None:
    """Memory that grows by 10 MB for each GB recorded, in noise; and one that does not."""
    noise = np.random.default_rng(1).normal(scale=0.5, size=400)
    found = [Reading(float(at), 100 + 0.01 * at + noise[at], 9, 3, at) for at in range(400)]
    rise, half = slope(found, "memory_mb")
    assert abs(rise - 10.0) < half < 2.0
    assert slope(told(0.0), "memory_mb")[0] == pytest.approx(0.0, abs=1e-6)


def test_a_program_is_watched_with_what_it_starts(tmp_path: Path) -> None:
    code = "import subprocess, sys, time; b = bytearray(60_000_000); time.sleep(1.5)"
    nested = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {code!r}])"
    (tmp_path / "a.mcap.partial").write_bytes(bytes(2_000_000))
    found = list(readings(psutil.Popen([sys.executable, "-c", nested]), tmp_path / "a.mcap", every_s=0.1))
    assert max(one.memory_mb for one in found) > 60
    assert {one.written_mb for one in found} == {2.0}


def test_a_missing_part_or_sample_is_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = split(tmp_path / "soak.mcap")
    assert soak.incomplete(open_recording(path), 2) == 0
    assert soak.incomplete(open_recording(path), 3) == 1
    (tmp_path / "soak.part003.mcap").unlink()
    assert soak.incomplete(open_recording(path), 2) == 1
    assert "soak.part003.mcap" in capsys.readouterr().out


def test_the_readings_are_kept_and_drawn(tmp_path: Path) -> None:
    soak.keep(told(0.0), tmp_path / "readings.csv")
    soak.draw(told(0.0), tmp_path / "soak.png")
    assert len((tmp_path / "readings.csv").read_text(encoding="utf-8").splitlines()) == 41
    assert (tmp_path / "soak.png").stat().st_size > 10_000
