"""The suite under one variant, and what became of its tests."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.portable.load import load
from tests.portable.variants import Variant

ROOT = Path(__file__).parents[2]
SYSTEM = "tests/system"
ENDED_WELL = {0, 1, 5}
"""Pytest's exit codes: all passed, some failed, none collected. Any other means that it did not get to the end."""


@dataclass(frozen=True)
class Outcome:
    """`failed` names tests so that pytest takes them as arguments."""

    variant: str
    passed: int
    skipped: int
    failed: tuple[str, ...]
    minutes: float


def run_suite(variant: Variant, *, tests: Sequence[str], jobs: int, folder: Path) -> Outcome:
    """Runs tests under a variant. The output and the results stay in a folder, beside the variant's own numba cache."""
    folder.mkdir(parents=True, exist_ok=True)
    environment = {**os.environ, **variant.environment, "NUMBA_CACHE_DIR": str(folder / "numba")}
    began = time.monotonic()
    outcomes: list[Outcome] = []
    with load(variant.busy), (folder / "output.txt").open("w", encoding="utf-8") as output:
        for number, words in enumerate(commands(tests, jobs=jobs)):
            results = folder / f"results-{number}.xml"
            results.unlink(missing_ok=True)
            code = _pytest([*words, f"--junitxml={results}"], environment=environment, output=output.fileno())
            outcomes.append(outcome_of(results, variant=variant.name, code=code))
    return Outcome(
        variant.name,
        sum(one.passed for one in outcomes),
        sum(one.skipped for one in outcomes),
        tuple(name for one in outcomes for name in one.failed),
        (time.monotonic() - began) / 60,
    )


def commands(tests: Sequence[str], *, jobs: int) -> list[list[str]]:
    """The arguments of pytest, as in `make test`: tests with processes of their own come after the others."""
    words = ["-n", str(jobs), "-q", "-p", "no:cacheprovider", "-o", "junit_family=xunit1"]
    whole = [test for test in tests if Path(test) in {Path("."), Path("tests")}]
    system = [test for test in tests if Path(test).is_relative_to(SYSTEM)] + [SYSTEM for _ in whole[:1]]
    others = [test for test in tests if not Path(test).is_relative_to(SYSTEM)]
    found: list[list[str]] = []
    if others:
        found.append([*words, "--dist", "loadfile", *others, f"--ignore={SYSTEM}"])
    if system:
        found.append([*words, "--dist", "loadfile", *system])
    return found


def _pytest(words: Sequence[str], *, environment: Mapping[str, str], output: int) -> int:
    """Its exit code. When this process is told to end, pytest may take down first what its tests have started."""
    child = subprocess.Popen(
        [sys.executable, "-m", "pytest", *words],
        cwd=ROOT,
        env=environment,
        stdout=output,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )
    try:
        return child.wait()
    except BaseException:
        child.send_signal(signal.SIGINT)
        child.wait()
        raise


def outcome_of(results: Path, *, variant: str, code: int) -> Outcome:
    """The counts in pytest's file of results; a run that did not get to the end counts as a failure of its own."""
    passed, skipped, failed = 0, 0, list[str]()
    for case in ET.parse(results).iter("testcase") if results.exists() else ():
        kinds = {child.tag for child in case}
        if kinds & {"failure", "error"}:
            failed.append(f"{case.get('file', '')}::{case.get('name')}")
        elif "skipped" in kinds:
            skipped += 1
        else:
            passed += 1
    if code not in ENDED_WELL:
        failed.append(f"pytest ended with {code} before its last test")
    return Outcome(variant, passed, skipped, tuple(dict.fromkeys(failed)), 0.0)
