"""What `station` says of itself: alone, of each command, and of a word that it does not know."""

from __future__ import annotations

import pytest

from station.__main__ import commands, main


def test_alone_it_shows_help_with_the_exit_statuses(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    said = capsys.readouterr().out
    assert "Exit status: 0" in said
    assert all(name in said for name in commands())


@pytest.mark.parametrize("name", commands())
def test_a_commands_help_ends_with_an_example_of_it(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main([*name.split(), "--help"])
    said = capsys.readouterr().out
    assert said.rstrip().splitlines()[-1].startswith(f"  station {name}")
    for nothing in ("(default: None)", "(default: False)", "(default: )"):
        assert nothing not in said


@pytest.mark.parametrize(
    ("words", "meant"), [(["rnu"], "did you mean run?"), (["doctor", "a.mcap", "--jsno"], "did you mean --json?")]
)
def test_a_slip_of_the_pen_is_named(words: list[str], meant: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(words)
    assert meant in capsys.readouterr().err
