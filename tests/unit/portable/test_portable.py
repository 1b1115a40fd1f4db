"""The suite under other code paths: the variants take other ones, the counts are the tests', the load ends with it."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.patience import PATIENCE_S
from tests.portable.__main__ import main, row, worthwhile
from tests.portable.paths import Paths, paths
from tests.portable.suite import ROOT, SYSTEM, Outcome, commands, outcome_of, run_suite
from tests.portable.variants import PLAINEST, Variant, taken, variants

MODERN = Paths(("X86_V3",), ("AVX2", "AVX512-SKX"), True, ("SkylakeX",), "host", "01234567", (8, 8))
OLD = Paths((), (), False, ("Nehalem",), "host", "89abcdef", (1, 1))
LOADED = """
import signal, time
from tests.portable.load import load

signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs inherit that it is ignored
with load(2):
    print("ready", flush=True)
    time.sleep(250)
"""
ONE_OF_EACH = """
import os
import pytest

def test_that_passes():
    assert os.environ["OPENBLAS_CORETYPE"] == "Prescott"

def test_that_fails():
    assert False

@pytest.mark.parametrize("way", ["here"])
def test_that_cannot_be_set_up(way, no_such_fixture):
    pass

def test_that_is_skipped():
    pytest.skip("not here")
"""


def names(here: Paths, machine: str) -> set[str]:
    return {one.name for one in variants(here, machine=machine)}


def test_a_processor_is_asked_only_for_code_that_it_can_run():
    assert "blas-skylakex" in names(MODERN, "x86_64")
    assert {name for name in names(OLD, "x86_64") if "blas" in name} == {"blas-prescott", "blas-nehalem"}
    assert {name for name in names(OLD, "aarch64") if "blas" in name} == {"blas-armv8"}
    assert not {name for name in names(OLD, "riscv64") if "blas" in name}


def test_the_plainest_variant_takes_no_path_beyond_the_baseline():
    here = paths()
    plainest = next(one for one in variants(here) if one.name == PLAINEST)
    found = taken(plainest)
    assert (found.numpy, found.opencv, found.ipp, found.numba, found.threads) == ((), (), False, "generic", (1, 1))
    assert found != here or not here.numpy  # under a variant itself there may be nothing left to take away


def test_what_became_of_each_test_is_told(tmp_path: Path):
    test = tmp_path / "test_one_of_each.py"
    test.write_text(ONE_OF_EACH)
    variant = Variant("tried", "", {"OPENBLAS_CORETYPE": "Prescott"}, busy=1)
    found = run_suite(variant, tests=[str(test)], jobs=1, folder=tmp_path / "out")
    assert (found.variant, found.passed, found.skipped) == ("tried", 1, 1)
    assert [name.partition("::")[2] for name in found.failed] == ["test_that_fails", "test_that_cannot_be_set_up[here]"]
    assert "no_such_fixture" in (tmp_path / "out" / "output.txt").read_text()
    assert row(found).count("\n") == 1


def test_a_run_without_results_is_a_failure(tmp_path: Path):
    found = outcome_of(tmp_path / "none.xml", variant="tried", code=-11)
    assert found == Outcome("tried", 0, 0, ("pytest ended with -11 before its last test",), 0.0)


@pytest.mark.parametrize(
    ("tests", "runs"),
    [
        (["tests"], [["tests", f"--ignore={SYSTEM}"], [SYSTEM]]),
        (["tests/unit", "tests/golden"], [["tests/unit", "tests/golden", f"--ignore={SYSTEM}"]]),
        (["tests/system/test_rig.py"], [["tests/system/test_rig.py"]]),
    ],
)
def test_tests_with_processes_of_their_own_come_after_the_others(tests: list[str], runs: list[list[str]]):
    for words, run in zip(commands(tests, jobs=2), runs, strict=True):
        assert words[-len(run) :] == run


def test_a_variant_that_is_not_here_is_one_sentence(capsys: pytest.CaptureFixture[str]):
    with pytest.raises(SystemExit) as ended:
        main(["--variant", "abacus"])
    assert ended.value.code == 2
    known = ", ".join(one.name for one in worthwhile())  # fewer where the suite itself runs as a variant
    assert f"expected --variant to be one of {known}, got abacus" in capsys.readouterr().err


@pytest.mark.parametrize("way", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_the_load_ends_with_the_process_that_started_it(way: signal.Signals):
    words = [sys.executable, "-c", LOADED]
    with subprocess.Popen(words, cwd=ROOT, text=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        assert process.stdout
        assert process.stdout.readline() == "ready\n"
        process.send_signal(way)
        # The busy processes hold the other end of this pipe: it ends with the last of them.
        assert process.communicate(timeout=PATIENCE_S)[0] == ""
