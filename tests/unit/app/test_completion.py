"""The Tab key offers every command and every option, in the shells that are installed here."""

from __future__ import annotations

import contextlib
import io
import shutil
import subprocess
from pathlib import Path

import pytest

from station.__main__ import commands, main
from tests.patience import PATIENCE_S


@pytest.fixture(scope="module")
def scripts(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The script of each shell."""
    folder, made = tmp_path_factory.mktemp("completion"), dict[str, Path]()
    for shell in ("bash", "zsh", "fish"):
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            assert main(["completion", shell]) == 0
        made[shell] = folder / f"station.{shell}"
        made[shell].write_text(printed.getvalue(), encoding="utf-8")
    return made


def offered(script: Path, *words: str, program: str = "station") -> list[str]:
    """Returns what bash offers after these words; the last one is begun."""
    if shutil.which("bash") is None:
        pytest.skip("no bash here")
    typed = " ".join(f"'{word}'" for word in (program, *words))
    function = f"_{program.replace('-', '_')}"
    ask = f"COMP_WORDS=({typed}); COMP_CWORD={len(words)}; {function}; printf '%s\\n' \"${{COMPREPLY[@]}}\""
    done = subprocess.run(
        ["bash", "-c", f". '{script}'; {ask}"], capture_output=True, text=True, check=True, timeout=PATIENCE_S
    )
    assert done.stderr == ""
    return done.stdout.split()


def test_bash_offers_every_command(scripts: dict[str, Path]) -> None:
    assert set(offered(scripts["bash"], "")) == {name.split()[0] for name in commands()}
    assert offered(scripts["bash"], "doc") == ["doctor"]


def test_bash_offers_the_options_of_the_command_and_of_no_other(scripts: dict[str, Path]) -> None:
    assert offered(scripts["bash"], "run", "--lock") == ["--lockstep"]
    assert offered(scripts["bash"], "run", "--screen") == []
    assert offered(scripts["bash"], "replay", "sim.mcap", "--screen") == ["--screenshot"]


def test_bash_knows_commands_of_two_words(scripts: dict[str, Path]) -> None:
    assert offered(scripts["bash"], "arm", "p") == ["plan"]
    assert offered(scripts["bash"], "arm", "stop", "--rea") == ["--reason"]
    assert "--reason" not in offered(scripts["bash"], "arm", "plan", "--")


def test_bash_leaves_file_names_to_itself(scripts: dict[str, Path]) -> None:
    assert offered(scripts["bash"], "doctor", "sim") == []


def test_bash_offers_the_words_that_may_stand_there(scripts: dict[str, Path]) -> None:
    assert offered(scripts["bash"], "completion", "z") == ["zsh"]


def test_the_camera_agent_is_completed_as_well(scripts: dict[str, Path]) -> None:
    assert set(offered(scripts["bash"], "", program="pi-agent")) == {"run", "track", "calibrate", "serve"}
    assert offered(scripts["bash"], "track", "a.png", "--js", program="pi-agent") == ["--json"]
    fish = scripts["fish"].read_text("utf-8")
    assert (
        "-c pi-agent -n __fish_use_subcommand -a run -d 'run the camera agent (the default, if there are options)'"
        in fish
    )
    assert "-c pi-agent -n '__fish_seen_subcommand_from run' -l camera -d ''" not in fish, "each has its explanation"


def test_zsh_and_fish_are_told_of_every_command(scripts: dict[str, Path]) -> None:
    zsh, fish = (scripts[name].read_text("utf-8") for name in ("zsh", "fish"))
    assert "bashcompinit" in zsh
    for name in commands():
        assert f"    {name})" in zsh or f"    '{name}')" in zsh
        assert f" -a {name.split()[-1]} " in fish


@pytest.mark.parametrize(("shell", "option"), [("bash", "-n"), ("zsh", "-n"), ("fish", "--no-execute")])
def test_the_shell_itself_can_read_it(shell: str, option: str, scripts: dict[str, Path]) -> None:
    if shutil.which(shell) is None:
        pytest.skip(f"no {shell} here")
    done = subprocess.run(
        [shell, option, str(scripts[shell])], capture_output=True, text=True, check=False, timeout=PATIENCE_S
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_zsh_offers_the_same(scripts: dict[str, Path]) -> None:
    if shutil.which("zsh") is None:
        pytest.skip("no zsh here")
    ask = "COMP_WORDS=(station run --lock); COMP_CWORD=2; setopt ksharrays; _station; print -l -- ${COMPREPLY[@]}"
    words = ["zsh", "-f", "-c", f"autoload -U +X compinit && compinit -D; . '{scripts['zsh']}'; {ask}"]
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=PATIENCE_S)
    offers = done.stdout.split()  # zsh itself leaves out those that begin otherwise
    assert "--lockstep" in offers, done.stderr
    assert "--screenshot" not in offers
