"""`.ci/run` goes on, and says so, where it is not root, has no apt, or cannot have a package or a wheel.

The script runs in a folder of its own, where `make`, `apt-get`, `id` and the environment's Python only write down what
they are asked for: nothing is installed.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.patience import PATIENCE_S

ROOT = Path(__file__).parents[3]
pytestmark = pytest.mark.skipif(
    shutil.which("bash") is None or shutil.which("timeout") is None, reason="the script wants bash and timeout"
)
# Writes down its words; fails when one of those in FAILING is among them, and takes its time for those in SLOW.
STUB = """\
#!/bin/sh
echo "$(basename "$0") $*" >>calls
for word in $SLOW; do case " $* " in *" $word "*) sleep 100 ;; esac; done
for word in $FAILING; do case " $* " in *" $word "*) exit 100 ;; esac; done
"""
PYTHON = STUB + f'case "$1" in -c) exec {sys.executable} "$@" ;; esac\n'
REAL = ("bash", "sh", "dirname", "basename", "timeout", "sleep")


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A checkout of nothing but the script and pyproject.toml, with programs of its own."""
    (tmp_path / ".ci").mkdir()
    shutil.copy(ROOT / ".ci/run", tmp_path / ".ci/run")
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    (tmp_path / "bin").mkdir()
    for name in REAL:
        (tmp_path / "bin" / name).symlink_to(str(shutil.which(name)))
    for name in ("make", "apt-get"):
        program(tmp_path / "bin" / name, STUB)
    program(tmp_path / "deploy/prepare.sh", STUB)
    program(tmp_path / "bin/id", "#!/bin/sh\necho 0\n")
    program(tmp_path / ".venv/bin/python", PYTHON)
    for name in ("python", "uv"):
        program(tmp_path / ".venv/uv/bin" / name, STUB)
    return tmp_path


def program(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    path.chmod(0o755)


def run(checkout: Path, *, failing: str = "", slow: str = "", quiet: bool = True) -> tuple[int, list[str], list[str]]:
    """Its exit status, the sentences that it says, and what was called."""
    environment = {"PATH": str(checkout / "bin"), "FAILING": failing, "SLOW": slow, "HOME": os.devnull}
    done = subprocess.run(
        ["bash", str(checkout / ".ci/run")],
        env=environment,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert not quiet or done.stderr == "", done.stderr
    calls = (checkout / "calls").read_text("utf-8").splitlines() if (checkout / "calls").exists() else []
    return done.returncode, done.stdout.splitlines(), calls


def installed(calls: list[str]) -> list[list[str]]:
    """The packages of each call that installs some with apt."""
    return [call.split("--no-install-recommends ")[1].split() for call in calls if "--no-install-recommends" in call]


def test_everything_is_fetched_before_the_tests(checkout: Path) -> None:
    status, said, calls = run(checkout)
    assert (status, said) == (0, [])
    (packages,) = installed(calls)
    assert {"openssh-server", "python3-rospy", "mesa-vulkan-drivers"} <= set(packages)
    assert [call for call in calls if call.startswith("make")] == ["make setup", "make test"]
    assert calls[-1] == "make test"
    (lock,) = [number for number, call in enumerate(calls) if "-r requirements.lock" in call]
    assert calls[lock].startswith("uv pip install")
    assert "--require-hashes" in calls[lock]
    assert calls.index("prepare.sh python3 .venv requirements.lock") < lock < calls.index("make setup")
    assert not any("--constraint" in call for call in calls if call.startswith("python"))
    wheels = [call.rpartition(" ")[2] for call in calls if "--constraint .venv/constraints.txt" in call]
    assert {wheel.partition(">")[0] for wheel in wheels} >= {"pybullet", "drake", "dartpy", "scikit-learn", "ray"}


def test_without_root_no_package_is_asked_for(checkout: Path) -> None:
    program(checkout / "bin/id", "#!/bin/sh\necho 1000\n")
    status, said, calls = run(checkout)
    assert status == 0
    assert said == ["CI goes on without Debian's packages: they need root; the tests that want it are skipped."]
    assert not any(call.startswith("apt-get") for call in calls)
    assert calls[-1] == "make test"


def test_without_apt_it_goes_on(checkout: Path) -> None:
    (checkout / "bin/apt-get").unlink()
    status, said, calls = run(checkout)
    assert status == 0
    assert said == ["CI goes on without Debian's packages: there is no apt-get; the tests that want it are skipped."]
    assert calls[-1] == "make test"


def test_a_package_that_is_not_there_costs_none_of_the_others(checkout: Path) -> None:
    status, said, calls = run(checkout, failing="update systemd")
    assert status == 0
    together, *alone = installed(calls)
    assert alone == [[package] for package in together]
    assert [sentence.split(":")[0] for sentence in said] == ["CI goes on without systemd"]


def test_a_wheel_that_is_not_there_costs_none_of_the_others(checkout: Path) -> None:
    status, said, calls = run(checkout, failing="drake>=1.51")
    assert status == 0
    assert [sentence.split(":")[0] for sentence in said] == ["CI goes on without drake>=1.51"]
    tried = [call.split()[0] for call in calls if "--constraint" in call]
    assert (tried.count("uv"), tried.count("python")) == (9, 1)
    assert calls[-1] == "make test"


def test_without_uv_pip_installs_the_wheels(checkout: Path) -> None:
    (checkout / ".venv/uv/bin/python").unlink()
    (checkout / ".venv/uv/bin/uv").unlink()
    status, said, calls = run(checkout, quiet=False)
    assert status == 0
    assert said == [
        "CI goes on with pip alone, which is slower: uv could not be installed.",
        "pip installs the lock, which is slower.",
    ]
    assert sum(call.startswith("python") and "--constraint" in call for call in calls) == 9


def test_what_is_slow_takes_no_longer_than_its_limit(checkout: Path) -> None:
    """The first package's server and the first wheel's hold it up for ever; after the limit no other is asked for."""
    script = checkout / ".ci/run"
    text = script.read_text("utf-8").replace("APT_LIMIT_S=300", "APT_LIMIT_S=2")
    script.write_text(text.replace("WHEELS_LIMIT_S=240", "WHEELS_LIMIT_S=2"), encoding="utf-8")
    status, said, calls = run(checkout, slow="openssh-server pybullet>=3.2.7")
    assert status == 0
    assert len(installed(calls)) == 1
    assert sum("openssh-server: " in sentence for sentence in said) == 1
    assert any("pybullet" in sentence for sentence in said)
    assert calls[-1] == "make test"


@pytest.mark.parametrize("target", ["setup", "test"])
def test_a_setup_or_a_test_that_fails_fails_it(checkout: Path, target: str) -> None:
    status, _, calls = run(checkout, failing=target)
    assert status != 0
    assert [call for call in calls if call.startswith("make")][-1] == f"make {target}"
