"""`station` says what it is: alone, of each command, and of a word that it does not know."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from station.__main__ import commands, main


def test_alone_it_shows_help_with_the_exit_statuses(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    said = capsys.readouterr().out
    assert "Exit status: 0" in said
    assert all(name in said for name in commands())


@pytest.mark.parametrize("words", [["keys"], ["keys", "--help"], ["keys", "-h"]])
def test_the_first_of_two_words_shows_the_commands_that_begin_with_it(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words) == 0
    said = capsys.readouterr().out
    assert said.startswith("usage: station keys ")
    assert all(f"    {name} " in said for name in ("new", "revoke", "sign"))
    assert "plan" not in said


def test_a_command_names_the_longer_ones_that_begin_with_it(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["arm", "--help"])
    said = capsys.readouterr().out
    assert all(f"\n  station arm {name} " in said for name in ("import", "plan", "stop"))
    assert "station arm arm" not in said


@pytest.mark.parametrize("name", commands())
def test_a_commands_help_ends_with_an_example_of_it(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main([*name.split(), "--help"])
    said = capsys.readouterr().out
    assert said.rstrip().splitlines()[-1].startswith(f"  station {name}")
    for nothing in ("(default: None)", "(default: False)", "(default: )"):
        assert nothing not in said
    options = re.split(r"\n  (?=-)", said)
    assert not [one for one in options if one.count("(default:") > 1]


@pytest.mark.parametrize("name", commands())
def test_a_seed_is_no_negative_number(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """NumPy's own refusal is a traceback. The parser alone tells, before anything that else is missing."""
    with pytest.raises(SystemExit):
        main([*name.split(), "--help"])
    if "--seed SEED" in capsys.readouterr().out:
        with pytest.raises(SystemExit, match="2"):
            main([*name.split(), "--seed", "-1"])
        assert "argument --seed: expected a whole number of 0 or more, got '-1'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (["rnu"], "did you mean run?"),
        (["doctor", "a.mcap", "--jsno"], "did you mean --json?"),
        (["arm", "paln"], "did you mean arm plan?"),
        (["keys", "sing", "a.mcap"], "did you mean keys sign?"),
    ],
)
def test_a_slip_of_the_pen_is_named(words: list[str], meant: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(words)
    assert meant in capsys.readouterr().err


@pytest.mark.parametrize("name", commands())
def test_what_exit_status_1_means_is_in_the_help_and_in_the_page(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """A command's file says what a 1 means where it has one to give, and the page has the same words."""
    with pytest.raises(SystemExit, match="0"):
        main([*name.split(), "--help"])
    said = " ".join(capsys.readouterr().out.split())
    told = re.search(r"Exit status: 0: done; (?:1: (.*?); )?2: a mistake", said)
    assert told
    source = commands()[name].read_text(encoding="utf-8")
    assert bool(told[1]) == bool(re.search(r"\b(return|else) 1\b|\bexit_status\(", source))
    page = (Path(__file__).parents[3] / "station/README.md").read_text(encoding="utf-8")
    assert (f"| `{name}` | {told[1]} |" in page) == bool(told[1])


@pytest.mark.parametrize("name", commands())
def test_what_ctrl_c_gives_is_in_the_help_and_in_the_page(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """A command that hears Ctrl-C itself says in its file what it gives then, and the page has the same words."""
    with pytest.raises(SystemExit, match="0"):
        main([*name.split(), "--help"])
    told = re.search(r"; 130: stopped by Ctrl-C(?:, but (.*?))?\. Example:", " ".join(capsys.readouterr().out.split()))
    assert told
    source = commands()[name].read_text(encoding="utf-8")
    assert bool(told[1]) == bool(re.search(r"\b(until_stopped|stop_by_signal|handling|loop\.signals)\(", source))
    page = (Path(__file__).parents[3] / "station/README.md").read_text(encoding="utf-8")
    assert (f"| `{name}` | {told[1]} |" in page) == bool(told[1])
