"""The one pool: results in order, whole or not at all, one thread each, and no process that outlives its command."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Generator
from pathlib import Path
from typing import ClassVar

import pytest
from joblib import register_parallel_backend
from joblib.parallel import ThreadingBackend
from rich.console import Console

from station.app.work import work_on, write_json
from station.pool import on_backend, spread
from tests.patience import PATIENCE_S

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
SLOW = """
import os, sys, time
from pathlib import Path
from station.pool import spread

def work(path):
    path.write_text(str(os.getpid()))
    time.sleep(120)

if __name__ == "__main__":
    try:
        with spread(work, [Path(sys.argv[1]) / "a", Path(sys.argv[1]) / "b"], jobs=2) as done:
            list(done)
    except KeyboardInterrupt:
        print("Stopped.")
"""


def slower_first(number: int) -> tuple[int, int]:
    time.sleep(0.05 * (number == 0))
    return number, os.getpid()


def threads(_number: int) -> dict[str, str]:
    return {name: os.environ.get(name, "") for name in THREADS}


def not_the_third(number: int) -> int:
    if number == 3:
        raise ValueError("the third")
    return number


def holds_ctrl_c(_number: int) -> bool:
    return signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])


def write_its_name(path: Path) -> None:
    write_json(path, {"name": path.name})


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_come_in_the_order_of_the_tasks(jobs: int):
    with spread(slower_first, range(6), jobs=jobs) as results:
        found = list(results)
    assert [number for number, _ in found] == list(range(6))
    assert (os.getpid() in {process for _, process in found}) == (jobs == 1)


def test_no_task_is_no_work():
    with spread(not_the_third, [], jobs=2) as results:
        assert list(results) == []


@pytest.mark.parametrize("jobs", [1, 2])
def test_the_first_error_is_raised(jobs: int):
    with pytest.raises(ValueError, match="the third"), spread(not_the_third, range(6), jobs=jobs) as results:
        list(results)


def test_every_task_writes_its_own_result(tmp_path: Path):
    paths = [tmp_path / f"{number}.json" for number in range(5)]
    work_on(paths, write_its_name, jobs=2, title="writing", console=Console(quiet=True))
    assert [json.loads(path.read_text("utf-8"))["name"] for path in paths] == [path.name for path in paths]
    assert sorted(tmp_path.iterdir()) == paths


def test_only_the_workers_have_one_thread_each():
    """With one thread for this process too, whatever it compiled later failed if its environment was changed back."""
    before = dict(os.environ)
    with spread(threads, range(2), jobs=2) as results:
        assert list(results) == [dict.fromkeys(THREADS, "1")] * 2
    assert dict(os.environ) == before


class InWholeRounds(ThreadingBackend):
    """A backend that answers when all is done, as Ray's does.

    Its workers are threads: a process that is forked from one of many threads may wait for ever for a lock of theirs.
    """

    rounds: ClassVar[list[int]] = []

    @property
    def supports_return_generator(self) -> bool:
        return False

    def start_call(self) -> None:
        self.rounds.append(0)

    def submit(self, func: Callable[..., object], callback: Callable[..., object] | None = None) -> object:
        self.rounds[-1] += 1
        return super().submit(func, callback)


def test_a_backend_that_answers_whole_rounds_only_is_asked_round_by_round(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("station.pool._ROUND", 4)
    monkeypatch.setattr(InWholeRounds, "rounds", [])
    register_parallel_backend("whole rounds", InWholeRounds)
    with on_backend("whole rounds", n_jobs=2), spread(not_the_third, [0, 1, 2] * 3) as results:
        assert list(results) == [0, 1, 2] * 3
    assert InWholeRounds.rounds == [4, 4, 1]


@pytest.fixture
def slow(tmp_path: Path) -> Generator[tuple[subprocess.Popen[str], list[int]]]:
    """A command at work, and its two processes; all are of one process group, as on a terminal."""
    script = tmp_path / "slow.py"
    script.write_text(SLOW, encoding="utf-8")
    command = subprocess.Popen(
        [sys.executable, str(script), str(tmp_path)],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    names = [tmp_path / name for name in ("a", "b")]
    try:
        _until(lambda: all(name.exists() and name.read_text() for name in names), "both workers at work")
        yield command, [int(name.read_text()) for name in names]
    finally:
        command.kill()
        command.communicate(timeout=PATIENCE_S)


@pytest.mark.skipif(sys.platform == "win32", reason="kill -9 is not of this system")
def test_workers_end_with_a_command_that_is_killed(slow: tuple[subprocess.Popen[str], list[int]]):
    """A proof that was killed left its workers, which went on with their cases and then waited for ever."""
    command, workers = slow
    command.kill()
    command.wait(30)
    _until(lambda: not any(_runs(worker) for worker in workers), "both workers gone")


@pytest.mark.skipif(sys.platform == "win32", reason="process groups are not of this system")
def test_ctrl_c_ends_command_and_workers_in_one_word(slow: tuple[subprocess.Popen[str], list[int]]):
    """A terminal sends it to all of them."""
    command, workers = slow
    os.killpg(command.pid, signal.SIGINT)
    said, _ = command.communicate(timeout=PATIENCE_S)
    assert said == "Stopped.\n"
    _until(lambda: not any(_runs(worker) for worker in workers), "both workers gone")


@pytest.mark.skipif(sys.platform == "win32", reason="signals cannot be held back on this system")
def test_workers_never_hear_ctrl_c_and_their_command_does():
    """One that was still importing printed a traceback."""
    with spread(holds_ctrl_c, range(4), jobs=2) as held:
        assert all(held)
    assert not holds_ctrl_c(0)


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
