"""The names of the Python interface, and what `import station` loads."""

from __future__ import annotations

import subprocess
import sys

import pytest

import shared.errors
import station
from tests.unit.diagnosis.recorded import GOLDEN

HEAVY = {"matplotlib", "mujoco", "cv2", "zenoh", "scipy", "numba", "rerun", "pandas", "pyarrow"}
PRINT_LOADED = "; import sys; print(*sorted({name.partition('.')[0] for name in sys.modules}))"


def loaded_by(code: str) -> set[str]:
    """The packages that a program of its own has loaded after this code."""
    words = [sys.executable, "-c", code + PRINT_LOADED]
    done = subprocess.run(words, capture_output=True, encoding="utf-8", check=False)
    assert done.returncode == 0, done.stderr
    return set(done.stdout.split())


def test_the_names_are_these() -> None:
    assert station.__all__ == [
        *("Analysed", "Diagnosed", "Recording", "Simulated", "Table", "UserError"),
        *("analyze", "diagnose", "open", "simulate"),
    ]
    assert set(station.__all__) <= set(dir(station))


@pytest.mark.parametrize("name", station.__all__)
def test_each_name_is_there_and_says_what_it_is(name: str) -> None:
    value = getattr(station, name)
    assert value.__name__ == name
    assert len(value.__doc__) > 40


def test_another_name_is_no_attribute() -> None:
    with pytest.raises(AttributeError, match="'station' has no attribute 'close'"):
        station.close  # noqa: B018  # pyright: ignore[reportAttributeAccessIssue, reportUnusedExpression]


def test_import_station_loads_nothing_heavy() -> None:
    assert not loaded_by("import station; dir(station)") & {*HEAVY, "numpy", "rich", "mcap"}


def test_tables_are_read_without_what_only_figures_and_simulators_need() -> None:
    code = (
        f"import station; it = station.open({str(GOLDEN)!r}); it.samples, it.corners, it.attitude, it.events; repr(it)"
    )
    loaded = loaded_by(code)
    assert "numpy" in loaded
    assert not loaded & HEAVY


def test_what_is_raised_is_the_error_of_the_commands() -> None:
    assert station.UserError is shared.errors.UserError
