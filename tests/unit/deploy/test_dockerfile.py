"""The Dockerfile against the checkout, checked without an engine: what it copies, installs and starts."""

from __future__ import annotations

import re
import shlex
import subprocess
import tomllib
from fnmatch import fnmatch
from pathlib import Path

import pytest

from station.__main__ import main

ROOT = Path(__file__).parents[3]
TEXT = (ROOT / "deploy" / "Dockerfile").read_text(encoding="utf-8")
IGNORED = (ROOT / "deploy" / "Dockerfile.dockerignore").read_text(encoding="utf-8").splitlines()
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
STEPS = [line.split(maxsplit=1) for line in re.sub(r"\\\n", " ", TEXT).splitlines() if line and line[0] != "#"]
SHOWN = [line.lstrip("# ") for line in re.sub(r" \\\n# +", " ", TEXT).splitlines() if "docker run" in line]


def words_of(instruction: str) -> list[list[str]]:
    return [shlex.split(rest) for name, rest in STEPS if name == instruction]


def test_all_that_is_copied_is_there_and_is_sent_to_the_engine():
    sources = {word for words in words_of("COPY") if not words[0].startswith("--from") for word in words[:-1]}
    sent = {line[1:] for line in IGNORED if line.startswith("!")}
    assert sources == sent
    assert all((ROOT / source).exists() for source in sources)
    assert any(fnmatch("anything", line) for line in IGNORED)


def test_what_the_packages_are_built_from_is_copied():
    read_by_the_build = {"pyproject.toml", PROJECT["readme"], "shared", "pi_agent", "station"}
    copied = {word for words in words_of("COPY") for word in words}
    assert read_by_the_build <= copied


def test_the_extras_exist():
    for named in re.findall(r"EXTRAS=([\w,]+)", TEXT):
        assert set(named.split(",")) <= set(PROJECT["optional-dependencies"])


def test_the_constraints_are_the_locks_pins(tmp_path: Path):
    step = next(rest for name, rest in STEPS if name == "RUN" and "sed" in rest)
    pins = tmp_path / "pins.txt"
    subprocess.run(["sh", "-c", step.replace("/tmp/pins.txt", str(pins))], cwd=ROOT, check=True)
    lines = [line for line in pins.read_text().splitlines() if not line.lstrip().startswith("#")]
    locked = [line for line in (ROOT / "requirements.lock").read_text().splitlines() if re.match(r"[\w.-]+==", line)]
    assert lines == [line.removesuffix(" \\") for line in locked]


def test_it_starts_a_command_that_is_installed():
    assert "station" in PROJECT["scripts"]
    assert [rest for name, rest in STEPS if name == "ENTRYPOINT"] == ['["station"]']


@pytest.mark.parametrize("line", [line for line in SHOWN if "--entrypoint" not in line])
def test_the_commands_that_are_shown_exist(line: str, capsys: pytest.CaptureFixture[str]):
    words = shlex.split(line)
    command, *options = words[words.index("repose") + 1 :]
    with pytest.raises(SystemExit):
        main([command, "--help"])
    said = capsys.readouterr().out
    assert all(option in said for option in options if option.startswith("--"))


def test_the_web_view_listens_where_a_published_port_leads_and_is_published_to_this_machine_alone():
    served = next(line for line in SHOWN if "--serve-web" in line)
    assert "--bind 0.0.0.0" in served
    ports = set(re.findall(r"-p (\S+)", served))
    exposed = next(rest for name, rest in STEPS if name == "EXPOSE").split()
    assert ports == {f"127.0.0.1:{port}:{port}" for port in exposed}
