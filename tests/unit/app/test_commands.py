"""The `station` command: what every subcommand owes its user."""

from __future__ import annotations

import argparse
import gc
import importlib
from collections.abc import Callable
from pathlib import Path

import pytest

from shared.errors import UserError
from station import __main__ as command
from station.app.commands import samples

GOLDEN = Path(__file__).parents[2] / "golden" / "session.mcap"
FILES = sorted(path.stem for path in command.COMMANDS.glob("[a-z]*.py"))


@pytest.mark.parametrize("stem", FILES)
def test_every_command_has_a_name_a_line_of_help_and_a_docstring(stem: str):
    module = importlib.import_module(f"station.app.commands.{stem}")
    assert module.NAME
    assert module.NAME.replace(" ", "_").replace("-", "_") == stem.rstrip("_")
    assert 10 < len(module.HELP) < 120
    assert not module.HELP.endswith(".")
    assert len(module.__doc__ or "") > 40
    file = command.COMMANDS / f"{stem}.py"
    for name in ("NAME", "HELP"):  # the module says the same as the file, which `station --help` reads
        assert command._constant(file, name) == getattr(module, name)  # pyright: ignore[reportPrivateUsage]
    assert callable(module.add_arguments)
    assert callable(module.run)


@pytest.mark.parametrize("stem", FILES)
def test_every_command_explains_itself(stem: str, capsys: pytest.CaptureFixture[str]):
    module = importlib.import_module(f"station.app.commands.{stem}")
    with pytest.raises(SystemExit) as ended:
        command.main([*module.NAME.split(), "--help"])
    assert ended.value.code == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert f"station {module.NAME}" in printed
    assert " ".join((module.__doc__ or "").split())[:40] in printed


def test_the_overview_lists_every_command(capsys: pytest.CaptureFixture[str]):
    with pytest.raises(SystemExit) as ended:
        command.main(["--help"])
    assert ended.value.code == 0
    printed = capsys.readouterr().out
    for stem in FILES:
        assert importlib.import_module(f"station.app.commands.{stem}").NAME in printed


def failing(error: BaseException) -> Callable[[argparse.Namespace], int]:
    def run(_options: argparse.Namespace) -> int:
        raise error

    return run


def test_a_users_mistake_is_one_line_and_exit_status_2(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setattr(samples, "run", failing(UserError("Expected this, got that; do so")))
    assert command.main(["samples", "x.mcap"]) == 2
    captured = capsys.readouterr()
    assert captured.err == "station samples: Expected this, got that; do so\n"
    assert captured.out == ""


def test_ctrl_c_is_exit_status_130(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    monkeypatch.setattr(samples, "run", failing(KeyboardInterrupt()))
    assert command.main(["samples", "x.mcap"]) == 130
    assert "Traceback" not in capsys.readouterr().err


def test_an_unknown_command_is_exit_status_2(capsys: pytest.CaptureFixture[str]):
    with pytest.raises(SystemExit) as ended:
        command.main(["no-such-command"])
    assert ended.value.code == 2
    assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--samples", "0"), "Expected --samples to be 1 or more, got 0"),
        (("--plan", "none.toml"), "Expected a TOML file at none.toml"),
        (("--out", "taken.mcap"), "taken.mcap exists"),
        (("--out", "name"), "to end in .mcap, got 'name'"),
    ],
)
def test_the_rig_is_not_started_for_a_session_that_cannot_be(
    words: tuple[str, str],
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("taken.mcap").touch()
    assert command.main(["rig", "--no-view", *words]) == 2
    printed = capsys.readouterr()
    assert said in printed.err
    assert not printed.out


def test_a_command_that_is_asked_again_keeps_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    """Python's garbage of one command stayed for good when the next one began: 150 kB each time in one process."""
    words = ["doctor", str(GOLDEN)]
    assert command.main(words) == command.main(words)
    kept = gc.get_freeze_count()
    assert command.main(words) == command.main(words)
    assert capsys.readouterr().out
    assert gc.get_freeze_count() <= kept  # other tests may let go of some
