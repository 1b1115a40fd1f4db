"""Signals are heard within a block, and nobody hears them after it."""

import signal
import subprocess
import sys
import threading
from pathlib import Path
from types import FrameType

import pytest

from pi_agent.__main__ import main as pi_agent
from shared.system.processes import CAN_SPLIT, ENDING
from shared.system.signals import handling, until_stopped
from tests.patience import PATIENCE_S

FORKED = """
import os, signal, time
from shared.system.signals import until_stopped

with until_stopped():
    pass
child = os.fork()
if child == 0:
    time.sleep(600)
os.kill(child, signal.SIGTERM)
print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


def handlers() -> list[object]:
    return [signal.getsignal(number) for number in ENDING]


@pytest.mark.parametrize("number", ENDING)
def test_each_signal_that_asks_for_the_end_sets_the_event(number: signal.Signals):
    before = handlers()
    with until_stopped() as stopped:
        assert not stopped.is_set()
        signal.raise_signal(number)
        assert stopped.wait(PATIENCE_S)
    assert handlers() == before


def test_a_block_that_fails_leaves_nothing_behind():
    before = handlers()
    with pytest.raises(ValueError, match="mine"):
        _fail()
    assert handlers() == before


def _fail() -> None:
    with handling(_deaf):
        raise ValueError("mine")


def _deaf(_number: int, _frame: FrameType | None) -> None:
    pass


def test_another_thread_hears_nothing_and_runs_all_the_same():
    before, ran = handlers(), list[bool]()

    def work() -> None:
        with until_stopped() as stopped:
            ran.append(stopped.is_set())

    thread = threading.Thread(target=work)
    thread.start()
    thread.join(PATIENCE_S)
    assert ran == [False]
    assert handlers() == before


@pytest.mark.skipif(not CAN_SPLIT, reason="this system has no fork")
def test_a_process_that_is_forked_later_ends_when_it_is_asked_to():
    """A pool that forks ends its workers by SIGTERM: one that had inherited a handler waited for ever."""
    words = [sys.executable, "-c", FORKED]
    root = Path(__file__).parents[3]
    out = subprocess.run(words, cwd=root, capture_output=True, text=True, timeout=PATIENCE_S, check=True)
    assert (out.stdout, out.stderr) == (f"{-signal.SIGTERM}\n", "")


def test_the_camera_agent_that_is_called_here_leaves_no_handler(tmp_path: Path):
    before, file = handlers(), tmp_path / "rig.toml"
    nobody = '[bus]\ncamera = ""\narm = ""\nstation = ""\n'
    file.write_text(f'id = "a"\n{nobody}[camera]\ndriver = "synthetic"\n[camera.options]\nlight = "much"\n')
    assert pi_agent(["run", "--rig", str(file)]) == 2
    assert handlers() == before
