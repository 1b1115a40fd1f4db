"""A thousand inputs that nobody should send: each is answered, or refused in one clear sentence."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

from tests.fuzz.__main__ import main
from tests.fuzz.change import ANY, of_bytes, of_table, of_text, places
from tests.fuzz.target import Unclear, all_targets, command, refuse_control, refuse_unclear
from tests.fuzz.trial import LIMIT_BYTES, peak_bytes


@pytest.mark.timeout(900)  # 16 s of processor time, which a machine that does much else gives it in minutes
def test_a_thousand_inputs(capsys: pytest.CaptureFixture[str]) -> None:
    status = main(["--inputs", "1000", "--seed", "20261123"])
    assert status == 0, capsys.readouterr().out


def test_the_memory_of_the_process_that_starts_it_is_not_counted() -> None:
    large = np.ones(LIMIT_BYTES // 8)
    words = [sys.executable, "-c", "from tests.fuzz.trial import peak_bytes; print(peak_bytes())"]
    told = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    assert peak_bytes() > large.nbytes > 2 * int(told)


def test_the_same_number_is_the_same_input() -> None:
    for target in all_targets():
        assert target.make(Random("1 2")) == target.make(Random("1 2")), target.name
    assert of_bytes(Random(1), b"abc" * 9) != of_bytes(Random(2), b"abc" * 9)
    assert of_text(Random(1), b"a = 1\n") != of_text(Random(3), b"a = 1\n")
    assert of_table(Random(1), {"a": [1, 2]}) != {"a": [1, 2]}


def test_a_table_is_changed_however_often_and_deep_and_the_values_to_choose_from_never() -> None:
    """A list in itself, or one within many, was walked until Python gave up."""
    before = repr(ANY)
    deep: list[Any] = []
    for _ in range(50_000):
        deep = [deep]
    assert len(places([deep])) == 50_001
    deep.append(deep)
    assert len(places(deep)) == 50_001
    for number in range(300):
        of_table(Random(number), {"a": [[], {}], "b": {"c": [1]}})
    assert repr(ANY) == before


@pytest.mark.parametrize("text", ["", "Traceback (most recent call last)", "a" * 3000])
def test_what_is_no_clear_sentence_is_found(text: str) -> None:
    with pytest.raises(Unclear):
        refuse_unclear(text)


def test_what_a_terminal_obeys_is_found() -> None:
    refuse_control("ä € 😀\n\t")
    with pytest.raises(Unclear):
        refuse_control("cleared\x1b[2J")


def test_a_traceback_is_found() -> None:
    """A command that cannot exist ends by argparse, which is no answer and no sentence of ours."""
    with pytest.raises(SystemExit):
        command("no-such-command", "{file}")(Path(__file__))
