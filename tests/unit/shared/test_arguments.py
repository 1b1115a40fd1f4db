"""The parser of both programs: defaults where there are any, no abbreviations, and what may have been meant."""

from __future__ import annotations

import pytest

from shared.arguments import Parser, above_0, nearest, seed_of


@pytest.fixture
def parser() -> Parser:
    made = Parser(prog="program", description="About.\n\nMore.", epilog="Example:\n  program go 3")
    made.add_argument("place")
    made.add_argument("--samples", type=int, default=5, help="how many runs")
    made.add_argument("--rig", help="rig file")
    made.add_argument("--limit", type=above_0, default=1.0, help="limit")
    made.add_argument("--seed", type=seed_of, default=1, help="seed")
    made.add_argument("--quick", action="store_true", help="hurry")
    made.add_argument("--mu", type=float, default=0.4, help="friction, not %(default)s if known")
    made.add_argument("--fold", action="store_const", const=nearest, default=nearest, help="search anew")
    return made


def test_help_states_the_defaults_that_there_are(parser: Parser) -> None:
    told = parser.format_help()
    assert "how many runs (default: 5)" in told
    assert "not 0.4 if known" in told
    for none in ("None", "False", "function"):
        assert none not in told
    assert told.endswith("Example:\n  program go 3\n")


@pytest.mark.parametrize(("columns", "widest"), [(40, 38), (80, 78), (300, 118)])
def test_help_is_as_wide_as_the_terminal(columns: int, widest: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Text told in words is broken anew: lines of the source's own length would break once more, raggedly."""
    monkeypatch.setenv("COLUMNS", str(columns))
    line = (
        "every one of these lines is as long as a line of the source, and is broken where the terminal ends, not before"
    )
    example = f"  program go {'far ' * 30}there"
    told = Parser(prog="program", description=f"{line}\n{line}\n\n{example}", epilog=f"{line}\n{line}").format_help()
    assert example in told.splitlines()
    lines = [line for line in told.splitlines() if line != example]
    assert max(map(len, lines)) <= widest
    # Four sources' lines in two paragraphs: full lines, each with room for no further word of ten letters.
    assert sum(len(line) > widest - 10 for line in lines) >= 2 * (2 * len(line) // widest - 1)


def test_an_abbreviation_is_no_option(parser: Parser) -> None:
    assert parser.parse_known_args(["here", "--samp", "3"])[1] == ["--samp", "3"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["here", "--samples", "abc"], "argument --samples: expected a whole number, got 'abc'\n"),
        (["here", "--samples", "1.5"], "argument --samples: expected a whole number, got '1.5'\n"),
        (["here", "--mu", "low"], "argument --mu: expected a number, got 'low'\n"),
        (["here", "--limit", "0"], "argument --limit: expected a number above 0, got '0'\n"),
        (["here", "--limit", "nan"], "argument --limit: expected a number above 0, got 'nan'\n"),
        (["here", "--seed", "-1"], "argument --seed: expected a whole number of 0 or more, got '-1'\n"),
        (["here", "--seed", "one"], "argument --seed: expected a whole number of 0 or more, got 'one'\n"),
    ],
)
def test_it_says_that_a_number_is_expected(
    parser: Parser, words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        parser.parse_args(words)
    assert capsys.readouterr().err.endswith(said)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--sampels", "3"], "unrecognized arguments: --sampels 3; did you mean --samples?"),
        (["--sampels=3"], "unrecognized arguments: --sampels=3; did you mean --samples?"),
        (["--zzzzzz"], "unrecognized arguments: --zzzzzz\n"),
        (["more"], "unrecognized arguments: more\n"),
    ],
)
def test_it_proposes_an_option(parser: Parser, words: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        parser.refuse(words)
    assert said in capsys.readouterr().err


def test_it_proposes_a_command(capsys: pytest.CaptureFixture[str]) -> None:
    parser = Parser(prog="program")
    commands = parser.add_subparsers()
    commands.add_parser("replay")
    for word, said in (("rpelay", "did you mean replay?"), ("zzz", "choose from")):
        with pytest.raises(SystemExit, match="2"):
            parser.parse_args([word])
        assert said in capsys.readouterr().err
