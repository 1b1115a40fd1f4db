"""Processes that work on cases: whole results only, and none of them outlives the command."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from rich.console import Console

from station.app.work import THREADS, write_json
from tests.proof.workers import work_on

SLOW = """
import sys, time
from pathlib import Path
from rich.console import Console
from tests.proof.workers import work_on

def work(path):
    import os
    path.write_text(str(os.getpid()))
    time.sleep(120)

if __name__ == "__main__":
    work_on([Path(sys.argv[1]) / "a", Path(sys.argv[1]) / "b"], work, jobs=2, title="", console=Console(quiet=True))
"""


def write_threads(path: Path) -> None:
    write_json(path, {name: os.environ.get(name, "") for name in THREADS})


def write_its_name(path: Path) -> None:
    write_json(path, {"name": path.name})


def test_every_task_writes_its_own_result(tmp_path: Path):
    paths = [tmp_path / f"{number}.json" for number in range(5)]
    work_on(paths, write_its_name, jobs=2, title="writing", console=Console(quiet=True))
    assert [json.loads(path.read_text("utf-8"))["name"] for path in paths] == [path.name for path in paths]
    assert sorted(tmp_path.iterdir()) == paths


def test_only_the_workers_have_one_thread_each(tmp_path: Path):
    """With one thread for this process too, whatever it compiled later failed if its environment was changed back."""
    before = dict(os.environ)
    work_on([tmp_path / "a.json"], write_threads, jobs=1, title="", console=Console(quiet=True))
    assert json.loads((tmp_path / "a.json").read_text("utf-8")) == dict.fromkeys(THREADS, "1")
    assert dict(os.environ) == before


@pytest.mark.skipif(sys.platform == "win32", reason="kill -9 is not of this system")
def test_workers_end_with_a_command_that_is_killed(tmp_path: Path):
    """A proof that was killed left its workers, which went on with their cases and then waited for ever."""
    script = tmp_path / "slow.py"
    script.write_text(SLOW, encoding="utf-8")
    here = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])}
    command = subprocess.Popen([sys.executable, str(script), str(tmp_path)], env=here)
    names = [tmp_path / name for name in ("a", "b")]
    try:
        _until(lambda: all(name.exists() and name.read_text() for name in names), "both workers at work")
        workers = [int(name.read_text()) for name in names]
    finally:
        command.send_signal(signal.SIGKILL)
        command.wait(30)
    _until(lambda: not any(_runs(worker) for worker in workers), "both workers gone")


def _until(done: Callable[[], bool], what: str) -> None:
    last = time.monotonic() + 60.0
    while not done():
        assert time.monotonic() < last, f"waited a minute for {what}"
        time.sleep(0.05)


def _runs(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text("utf-8").rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"
