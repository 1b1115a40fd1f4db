"""`station deploy` against a real sshd on loopback, all the way to corners on the bus; systemd is played by a fake."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Generator, Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pytest

from shared.errors import UserError
from station.app.deploy.remote import Remote
from tests.patience import PATIENCE_S
from tests.system.deploy_target import (
    Target,
    install_fake_systemd,
    loopback_sshd,
    repack_wheels,
    secret,
)
from tests.system.ports import free_port

pytestmark = pytest.mark.system
CHECKOUT = Path(__file__).resolve().parents[2]
VIDEO = """\
driver = "video_file"
rate_hz = 60.0
[camera.options]
path = "pictures"
loop = true
"""
SYNTHETIC = 'driver = "synthetic"\n'
RIG = """\
id = "deployed-{port}"
[bus]
camera = "tcp/127.0.0.1:{port}"
arm = ""
station = ""
[camera]
{camera}"""
VERIFIED = r"Verified: (\d+) corners at ([\d.]+) Hz, marker found in (\d+).*?station ([-\d.]+) ms"


@dataclass
class Bench:
    """A target with an agent's rig, and the laptop's words to deploy to it."""

    target: Target
    root: Path
    rig: Path
    lock: Path
    code: Path
    good: str = ""

    def deploy(self, *more: str, supervisor: str = "systemd") -> subprocess.CompletedProcess[str]:
        words = [sys.executable, "-m", "station", "deploy", *self.target.words, "--rig", str(self.rig)]
        words += ["--root", str(self.root), "--supervisor", supervisor, "--python", sys.executable, "--offline"]
        words += ["--lock", str(self.lock), "--wheels", str(self.lock.parent), "--code", str(self.code)]
        words += ["--verify-seconds", "0", "--patience", str(0.8 * PATIENCE_S), *more]
        return subprocess.run(words, capture_output=True, text=True, check=False, cwd=CHECKOUT, timeout=PATIENCE_S)

    @property
    def home(self) -> Path:
        return self.root / "opt/repose"

    @property
    def current(self) -> str:
        link = self.home / "current"
        return link.readlink().name if link.is_symlink() else ""

    def runs_good(self) -> bool:
        return bool(self.good) and self.current == self.good and Path(f"/proc/{self.pid()}").exists()

    def calls(self) -> list[str]:
        """The verbs that systemctl was called with."""
        return [line.split()[0] for line in (self.root / "run/fake-systemd/calls").read_text().splitlines()]

    def pid(self) -> int:
        return int((self.root / "run/fake-systemd/pid").read_text())


def draw(folder: Path) -> None:
    """Pictures of a dark square at rest, each with a noise of its own: the same one again would be a frozen camera's.

    A busy machine drops frames, and what moves would have another speed from one that came to the next.
    """
    folder.mkdir()
    rng = np.random.default_rng(1)
    for number in range(30):
        image = np.full((600, 600), 200.0)
        image[270:332, 265:327] = 30.0
        noisy = cv2.GaussianBlur(image, (0, 0), 0.8) + rng.normal(size=image.shape)
        cv2.imwrite(str(folder / f"{number:02}.png"), noisy.round().astype(np.uint8))


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    folder = tmp_path_factory.mktemp("deploy")
    (folder / "ssh").mkdir()
    with loopback_sshd(folder / "ssh") as target:
        root, laptop = folder / "target", folder / "laptop"
        root.mkdir()
        laptop.mkdir()
        draw(laptop / "pictures")
        rig = laptop / "rig.toml"
        rig.write_text(RIG.format(port=free_port(), camera=VIDEO))
        code = laptop / "code"
        for package in ("pi_agent", "shared"):
            shutil.copytree(CHECKOUT / package, code / package, ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copy(CHECKOUT / "pyproject.toml", code)
        install_fake_systemd(target, root)
        bench = Bench(target, root, rig, repack_wheels(folder / "wheels"), code)
        try:
            yield bench
        finally:
            with contextlib.suppress(OSError, ValueError):
                os.kill(bench.pid(), signal.SIGKILL)


@pytest.fixture
def good(bench: Bench) -> Bench:
    """The bench with a release that works; deployed anew only when a test before has left another one."""
    if not bench.runs_good():
        done = bench.deploy()
        assert done.returncode == 0, done.stdout + done.stderr
        bench.good = bench.current
    return bench


@pytest.fixture
def installed(bench: Bench) -> Bench:
    """The bench with any release that runs."""
    if not bench.current:
        done = bench.deploy()
        assert done.returncode == 0, done.stdout + done.stderr
    return bench


@contextlib.contextmanager
def edited(path: Path, old: str, new: str) -> Generator[None]:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    try:
        yield
    finally:
        path.write_text(text)


def test_corners_arrive_at_the_station_and_a_second_deployment_changes_nothing(good: Bench):
    pid, release, calls = good.pid(), good.current, good.calls()
    done = good.deploy("--verify-seconds", "1")
    assert done.returncode == 0, done.stdout + done.stderr
    verified = re.search(VERIFIED, done.stdout)
    assert verified, done.stdout
    count, rate_hz, found, latency_ms = map(float, verified.groups())
    assert found == count > 0
    assert rate_hz > 0, done.stdout + done.stderr
    assert latency_ms > 0
    assert f"+{release.rpartition('-')[2]}" in done.stdout, "the agent says which release it is"
    assert {path.name for path in (good.home / "current").iterdir() if path.is_dir()} >= {"pi_agent", "shared", "venv"}
    assert not (good.home / "current/station").exists()
    assert (good.root / "run/fake-systemd/enabled").exists()
    assert "nothing to copy" in done.stdout
    assert "Nothing had to change" in done.stdout
    assert (good.pid(), good.current) == (pid, release)
    assert not {"restart", "daemon-reload", "stop"} & set(good.calls()[len(calls) :])


def test_new_code_is_copied_without_its_dependencies_and_switched_to(good: Bench):
    before = good.current
    with edited(good.code / "shared/errors.py", '"""The one exception', '"""(changed) The one exception'):
        done = good.deploy()
    assert done.returncode == 0, done.stdout + done.stderr
    assert "its dependencies are there already" in done.stdout
    assert good.current != before
    assert (good.home / "previous").readlink().name == before
    back = good.deploy("--rollback")
    assert f"rolled back to release {before}" in back.stdout
    assert good.current == before


def test_code_that_does_not_import_never_replaces_what_runs(good: Bench):
    pid, release = good.pid(), good.current
    with edited(good.code / "pi_agent/agent.py", "import dataclasses", "import a_module_that_is_missing"):
        done = good.deploy()
    assert done.returncode == 2
    assert "a_module_that_is_missing" in done.stderr
    assert "Traceback" not in done.stderr
    assert (good.pid(), good.current) == (pid, release)
    assert not (good.home / "incoming").exists()


def test_an_agent_that_ends_by_itself_is_rolled_back(good: Bench):
    """It ends at once: on a busy machine one that first imports all it needs outlives the time that it is watched."""
    before = good.current
    first = "    words = list(sys.argv[1:] if argv is None else argv)\n"
    with edited(good.code / "pi_agent/__main__.py", first, "    raise SystemExit('dead')\n"):
        done = good.deploy()
    assert done.returncode == 2
    assert f"rolled back to release {before}" in done.stderr
    assert "dead" in done.stderr, "the end of its log is shown"
    assert good.runs_good()


def test_an_agent_that_sends_no_corners_is_rolled_back(good: Bench):
    before = good.current
    with edited(good.rig, VIDEO, SYNTHETIC):
        # Corners never come, so all of the patience is waited: as long as a busy machine takes to start the agent.
        done = good.deploy("--verify-seconds", "1", "--patience", "20")
    assert done.returncode == 2
    assert "start `station twin`" in done.stderr, "the agent's own sentence is passed on"
    assert f"rolled back to release {before}" in done.stderr
    assert good.runs_good()


def test_a_wheel_that_was_tampered_with_is_refused(good: Bench, tmp_path: Path):
    wheel = next(good.lock.parent.glob("protobuf-*.whl"))
    content = wheel.read_bytes()
    try:
        wheel.write_bytes(content + b"\0")
        done = good.deploy("--root", str(tmp_path), supervisor="none")
    finally:
        wheel.write_bytes(content)
    assert done.returncode == 2
    assert "not the pinned file" in done.stderr


def test_without_systemd_the_agent_runs_as_a_plain_process_and_that_is_said(good: Bench):
    """Also what happens when a target changes from one to the other: the first one's agent is stopped."""
    unit = good.root / "etc/systemd/system/pi-agent.service"
    assert unit.exists()
    done = good.deploy("--verify-seconds", "1", supervisor="none")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "nobody starts it again" in done.stdout
    assert "Verified" in done.stdout
    assert not unit.exists()
    assert good.deploy("--status", supervisor="none").returncode == 0
    pid = int((good.root / "var/lib/repose/agent.pid").read_text())
    done = good.deploy()
    assert done.returncode == 0, done.stdout + done.stderr
    assert not Path(f"/proc/{pid}").exists(), "back under systemd, the plain process is stopped"
    assert good.runs_good()


def test_keys_reach_the_target_and_only_the_agent_may_read_them(good: Bench, tmp_path: Path):
    text = secret()
    for name in ("ca.pem", "cert.pem", "key.pem"):
        (tmp_path / name).write_text(text)
    done = good.deploy("--keys", str(tmp_path))
    assert done.returncode == 0, done.stdout + done.stderr
    assert text not in done.stdout + done.stderr
    key = good.home / "current/keys/key.pem"
    assert key.read_text() == text
    assert key.stat().st_mode & 0o777 == 0o600
    assert key.parent.stat().st_mode & 0o777 == 0o700


def test_uninstalling_leaves_nothing(installed: Bench):
    good, pid = installed, installed.pid()
    done = good.deploy("--uninstall", "--purge")
    assert done.returncode == 0, done.stdout + done.stderr
    assert not Path(f"/proc/{pid}").exists() or "Z" in Path(f"/proc/{pid}/stat").read_text()
    left = [path for path in good.root.rglob("*") if path.is_file() and "fake-systemd" not in path.parts]
    assert left == []
    assert good.deploy("--status").returncode == 1
    assert good.deploy("--uninstall").returncode == 0, "a second time is harmless"


def test_a_target_that_does_not_answer_is_one_sentence(bench: Bench):
    words = [sys.executable, "-m", "station", "deploy", "127.0.0.1", "--port", str(free_port()), "--status"]
    done = subprocess.run(words, capture_output=True, text=True, check=False, cwd=CHECKOUT)
    assert done.returncode == 2
    assert "Expected an ssh connection to 127.0.0.1" in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("how", ["free", "password"])
def test_sudo_gets_its_password_and_the_command_gets_the_rest(bench: Bench, how: str, monkeypatch: pytest.MonkeyPatch):
    """With a sudo that behaves as the real one does: -S takes one line from standard input and nothing after it."""
    sudo = bench.target.bin / "sudo"
    sudo.write_text(
        f"#!{sys.executable}\nimport os, sys\nwords = sys.argv[1:]\n"
        "if words[0] == '-n':\n    words = words[1:]\n"
        "else:\n    assert words[:4] == ['-k', '-S', '-p', ''], words\n    words, line = words[4:], b''\n"
        "    while not line.endswith(b'\\n'):\n        line += os.read(0, 1)\n"
        "    line == b'secret\\n' or sys.exit('Sorry, try again.')\n"
        "os.execvp(words[0], words)\n"
    )
    sudo.chmod(0o755)
    target, *options = bench.target.words

    def ask(question: str) -> str:
        assert target in question
        return "secret"

    monkeypatch.setattr("getpass.getpass", ask)
    try:
        with Remote(target, port=bench.target.port, identity=options[3], options=options[5::2]) as remote:
            remote.become_root(how)
            assert remote.run("cat", given=b"data", root=True) == "data"
            place = bench.root / f"fed-{how}"
            with remote.feed("sh", "-c", f"cat > {place}") as sink:
                sink.write(b"more" * 100_000)
            assert place.read_bytes() == b"more" * 100_000
            place.unlink()
            with pytest.raises(UserError, match="`false` failed"):
                remote.run("false", root=True)
    finally:
        sudo.unlink()
