"""The part that runs on the target, below a folder that stands for its root."""

from __future__ import annotations

import fcntl
import json
import os
import pwd
import subprocess
import sys
from pathlib import Path

import pytest

from shared.bus_keys import tls_settings
from station.app.deploy.bundle import tool_archive
from station.app.deploy.target import account, clock, main
from station.app.deploy.target.paths import TargetPaths, point


def answer(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, object]:
    main.main([*words])
    return json.loads(capsys.readouterr().out)


def test_nothing_is_installed_and_nothing_breaks(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    root = ["--root", str(tmp_path), "--supervisor", "none"]
    found = answer(capsys, "status", *root)
    assert (found["current"], found["releases"], found["pid"]) == ("", [], 0)
    assert "Nothing is installed" in str(answer(capsys, "rollback", *root)["refused"])
    assert answer(capsys, "uninstall", *root) == {"left": []}


def test_two_deployments_at_once_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    held = os.open(tmp_path, os.O_RDONLY)
    fcntl.flock(held, fcntl.LOCK_EX)
    said = answer(capsys, "status", "--root", str(tmp_path), "--supervisor", "none")
    os.close(held)
    assert "under way" in str(said["refused"])
    assert "refused" not in answer(capsys, "status", "--root", str(tmp_path), "--supervisor", "none")


def test_calibrations_survive_an_uninstallation_unless_they_are_purged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    made = tmp_path / "var/lib/repose/calibration.toml"
    made.parent.mkdir(parents=True)
    made.touch()
    assert answer(capsys, "uninstall", "--root", str(tmp_path)) == {"left": [str(made.parent)]}
    assert made.exists()
    answer(capsys, "uninstall", "--root", str(tmp_path), "--purge")
    assert not made.parent.exists()


def test_keys_on_the_target_are_keys_that_the_agent_takes(tmp_path: Path):
    """They were readable by the agent's group, and no process takes a private key that others can read."""
    keys = tmp_path / "release" / "keys"
    keys.mkdir(parents=True)
    for name in ("ca.pem", "cert.pem", "key.pem"):
        (keys / name).touch(0o664)
    (keys / "rights.toml").write_text('rig = "lab"\nmembers.camera = ["camera.1"]\n')
    account.give_to_root(tmp_path / "release", account=pwd.getpwuid(os.geteuid()).pw_name)
    assert tls_settings(["tls/a:1"], rig_id="lab", process="camera", environment={"REPOSE_KEYS": str(keys)})


def test_chrony_is_told_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    told: list[tuple[str, ...]] = []

    def chronyc(*words: str) -> str:
        told.append(words)
        return ""

    monkeypatch.setattr(clock, "_chronyc", chronyc)
    paths = TargetPaths(tmp_path)
    assert clock.follow(paths, "192.168.7.1")
    assert "server 192.168.7.1 iburst" in paths.clock_source.read_text()
    assert not clock.follow(paths, "192.168.7.1")
    assert clock.follow(paths, "192.168.7.9"), "another laptop takes over"
    clock.forget(paths)
    assert not paths.clock_source.exists()
    assert told == [("reload", "sources")] * 3


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        (
            "C0A80701,192.168.7.1,11,1763683200.1,0.000021,0.0,0.0,0,0,0,0,0,1,Normal\n",
            {"source": "192.168.7.1", "offset_s": "0.000021"},
        ),
        ("506 Cannot talk to daemon\n", {}),
        ("", {}),
    ],
)
def test_what_chrony_says_is_read(monkeypatch: pytest.MonkeyPatch, said: str, expected: dict[str, str]):
    def chronyc(*words: str) -> str:
        assert words == ("-c", "tracking")
        return said

    monkeypatch.setattr(clock, "_chronyc", chronyc)
    assert clock.tracking() == expected


def test_a_link_is_switched_and_never_missing(tmp_path: Path):
    (tmp_path / "releases/a").mkdir(parents=True)
    (tmp_path / "releases/b").mkdir()
    link = tmp_path / "current"
    for name in ("a", "b"):
        point(link, tmp_path / "releases" / name)
        assert link.readlink() == Path("releases") / name
        assert not link.with_name("current.new").exists()


def test_the_archive_runs_by_itself_and_is_the_same_every_time(tmp_path: Path):
    archive = tmp_path / "deploy.pyz"
    archive.write_bytes(tool_archive())
    assert archive.read_bytes() == tool_archive()
    words = [sys.executable, "-I", str(archive), "status", "--root", str(tmp_path), "--supervisor", "none"]
    said = subprocess.run(words, capture_output=True, text=True, check=True, cwd=tmp_path).stdout
    assert json.loads(said)["current"] == ""
