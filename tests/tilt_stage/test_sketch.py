"""The sketch, compiled for this machine, says word for word what the emulator says, and obeys its own safety rules."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from station.arm.drivers._servo_lines import FOLLOWING, HELD, IDLE, LEVELLING, PER_DEGREE, Lines, line, stage_report
from tests.tilt_stage.emulated import EmulatedStage

HERE = Path(__file__).parent
SKETCH = HERE.parents[1] / "deploy" / "tilt_stage" / "tilt_stage"
Script = Sequence[bytes | int | bool]
"""Lines for the stage, times (ms) until which time passes, and whether the stop button is pressed."""


def emulated(script: Script) -> bytes:
    stage = EmulatedStage()
    for step in script:
        if isinstance(step, bool):
            stage.pressed = step
        elif isinstance(step, int):
            stage.advance(step)
        else:
            stage.hear(step)
    return stage.take()


@pytest.fixture(scope="module")
def sketch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    compiler = shutil.which("g++") or shutil.which("clang++")
    if compiler is None:
        pytest.skip("compiling the sketch needs g++ or clang++")
    program = tmp_path_factory.mktemp("sketch") / "stage"
    arduino = HERE / "arduino"
    words = ["-Wall", "-Werror", "-I", str(SKETCH), "-I", str(arduino), "-o", str(program), str(arduino / "main.cpp")]
    subprocess.run([compiler, *words], check=True)
    return program


def compiled(sketch: Path, script: Script) -> bytes:
    given = b"".join(
        b"!%d\n" % (not step) if isinstance(step, bool) else b"@%d\n" % step if isinstance(step, int) else step
        for step in script
    )
    return subprocess.run([sketch], input=given, capture_output=True, check=True).stdout


def degrees(*angles: float) -> list[int]:
    return [round(angle * PER_DEGREE) for angle in angles]


def tilting(to_deg: float, *, from_ms: int = 0) -> list[bytes | int | bool]:
    """Armed, then set-points every 20 ms at 20 degrees/s about both axes, one against the other."""
    script: list[bytes | int | bool] = [line("A")]
    for n in range(1, round(to_deg / 0.4) + 1):
        script += [line("T", n, *degrees(0.4 * n, -0.2 * n)), from_ms + 20 * n]
    return script


def hostile() -> list[bytes | int | bool]:
    """Random lines, damaged ones among them, at random times."""
    rng = np.random.default_rng(5)
    script, now_ms = [], 0
    for number in range(600):
        x, y = rng.uniform(-75, 75, 2) if rng.random() < 0.1 else rng.uniform(-4, 4, 2)
        said = [line("A"), line("S"), line("?"), line("T", number, *degrees(x, y)), b"T 1 2*0000\n", b"\xff*\n", b"A\n"]
        said += [line("T", number, *degrees(x, y))] * 12
        text = said[int(rng.integers(len(said)))]
        now_ms += int(rng.choice([1, 10, 20, 40, 300], p=[0.3, 0.3, 0.2, 0.19, 0.01]))
        script += [text, now_ms]
    return script


@pytest.mark.parametrize(
    "script",
    [
        [line("?"), 100, *tilting(30.0, from_ms=100)[1:], line("?")],
        [*tilting(30.0), 40_000, line("?")],
        [*tilting(30.0), line("S"), 20_000, line("A"), 20_600],
        [*tilting(30.0), True, 1600, line("A"), 1700, False, line("A"), 1900],
        [line("?", 2**30), 50, line("A"), 100, line("A", 7), 150, line("A", 2**30), *tilting(5.0)[1:], line("?"), 500],
        hostile(),
    ],
    ids=["unarmed", "forsaken", "stopped", "button", "named", "hostile"],
)
def test_the_sketch_and_the_emulator_are_the_same_stage(sketch: Path, script: Script) -> None:
    said = compiled(sketch, script)
    assert said == emulated(script)
    assert len(said.splitlines()) > 5


def reports(script: Script) -> list[tuple[str, float, float]]:
    """State and angles (degrees) of each report."""
    found = [stage_report(words, axes=2) for words in Lines().take(emulated(script))]
    return [(one.state, one.angles[0] / PER_DEGREE, one.angles[1] / PER_DEGREE) for one in found if one]


def test_a_stage_that_is_not_armed_does_not_move() -> None:
    assert {(state, x, y) for state, x, y in reports([100, *tilting(30.0, from_ms=100)[1:]])} == {(IDLE, 0.0, 0.0)}


def test_a_forsaken_stage_holds_and_then_levels() -> None:
    found = reports([*tilting(30.0), 40_000])
    assert [state for state, _, _ in found if state != IDLE][-1] == LEVELLING
    held = [x for state, x, _ in found if state == HELD]
    assert held == [pytest.approx(30.0, abs=0.1)] * len(held)
    assert 490 <= len(held) <= 510  # 5 s
    assert found[-1] == (IDLE, 0.0, 0.0)
    levelling = np.array([x for state, x, _ in found if state == LEVELLING])
    assert np.diff(levelling).max() <= 0
    assert np.diff(levelling).min() > -0.25  # 3 degrees/s in steps of the servo's resolution


@pytest.mark.parametrize(("word", "wanted"), [("limit", (69.0, 0.0)), ("jump", (0.0, 5.1))])
def test_what_is_beyond_a_limit_or_a_jump_is_refused(word: str, wanted: tuple[float, float]) -> None:
    script = [line("A"), line("T", 1, *degrees(*wanted)), 100]
    assert line("E", word) in emulated(script)
    assert reports(script)[-1] == (FOLLOWING, 0.0, 0.0)
