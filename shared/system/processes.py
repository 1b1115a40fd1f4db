"""Processes: how many processors there are, who is asked to end and how, and what an emergency stop is signalled by.

|                             | Linux, macOS             | Windows                              |
|-----------------------------|--------------------------|--------------------------------------|
| the user ends a program     | Ctrl-C (SIGINT), SIGTERM | Ctrl-C, Ctrl-Break (SIGBREAK)        |
| the terminal is closed      | SIGHUP, but under nohup  | (the program ends)                   |
| who started it has died     | its input ends           | its input ends                       |
| one program ends another    | SIGTERM                  | Ctrl-Break, to its group of processes |
| emergency stop of the arm   | SIGUSR1, `station arm stop` | `station arm stop`                |
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from functools import cache

if sys.platform == "linux":

    def usable_processors() -> int:
        """Returns the processors that this process may use."""
        return len(os.sched_getaffinity(0))
else:

    def usable_processors() -> int:
        """Returns the processors of the machine: this system keeps no process from any of them."""
        return os.cpu_count() or 1


CAN_SPLIT = sys.platform == "linux"
"""True if a process can `fork`: Windows has no fork, and macOS's own libraries do not survive it."""

if sys.platform == "win32":
    _ending, _emergency = (signal.SIGINT, signal.SIGTERM, signal.SIGBREAK), tuple[signal.Signals, ...]()
    _interrupting = _ending_it = signal.CTRL_BREAK_EVENT
    _new_session, _new_group = False, subprocess.CREATE_NEW_PROCESS_GROUP
else:
    _hung_up = () if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN else (signal.SIGHUP,)  # nohup has it ignored
    _ending, _emergency = (signal.SIGINT, signal.SIGTERM, *_hung_up), (signal.SIGUSR1,)
    _interrupting, _ending_it = signal.SIGINT, signal.SIGTERM
    _new_session, _new_group = True, 0

ENDING: tuple[signal.Signals, ...] = _ending
"""The signals by which a user or another program asks this one to end."""
EMERGENCY: tuple[signal.Signals, ...] = _emergency
"""The signals that stop the arm at once. Windows has none to spare: `station arm stop` says it over the bus."""
GRACE_S = 40.0
"""The time that an orphan may take to end in order: a session first brings the plate back to level, in up to 20 s."""
_FOLLOWS = "REPOSE_FOLLOWS_PARENT"
NEW_SESSION, NEW_GROUP = _new_session, _new_group
"""The `start_new_session` and `creationflags` of `Popen` with which Ctrl-C does not reach the child."""


def start_apart(words: Sequence[str]) -> subprocess.Popen[bytes]:
    """Starts somebody else's program, which reads from a pipe and prints to nobody; Ctrl-C does not reach it.

    Raises:
        OSError, ValueError: if it cannot be started; a ValueError is a word with a zero byte in it.
    """
    return subprocess.Popen(
        words,
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=NEW_SESSION,
        creationflags=NEW_GROUP,
    )


def kill_apart(process: subprocess.Popen[bytes]) -> None:
    """Ends a program of `start_apart` at once, with what it has started where the system knows them as a group."""
    with contextlib.suppress(OSError):
        if sys.platform == "win32":
            process.kill()
        else:
            os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    if process.stdin is not None:
        with contextlib.suppress(OSError):
            process.stdin.close()


def interrupt(process: subprocess.Popen[bytes]) -> None:
    """Sends to a process that `start` began what Ctrl-C would send."""
    process.send_signal(_interrupting)


def ask_to_end(process: subprocess.Popen[bytes]) -> None:
    """Asks a process that `start` began to end in order."""
    process.send_signal(_ending_it)


def start(
    words: Sequence[str], *, quiet: bool = False, piped: bool = False, env: Mapping[str, str] | None = None
) -> subprocess.Popen[bytes]:
    """Starts a program that Ctrl-C in this terminal does not reach.

    `quiet` throws away what it prints; `piped` gives it, errors as well, to whoever reads the process's `stdout`.

    One that calls `follow_parent` ends when this process does, however that ends.

    Raises:
        OSError: if it cannot be run.
    """
    prints = subprocess.PIPE if piped else subprocess.DEVNULL if quiet else None
    environment = {**(os.environ if env is None else env), _FOLLOWS: "1"}
    return subprocess.Popen(
        words,
        env=environment,
        stdin=_my_life(),
        stdout=prints,
        stderr=subprocess.STDOUT if piped else prints,
        start_new_session=NEW_SESSION,
        creationflags=NEW_GROUP,
    )


@cache
def _my_life() -> int:
    """Returns the read end of a pipe that nobody writes to and only this process holds open.

    It closes with the process.
    """
    reading, _ = os.pipe()
    return reading


def follow_parent() -> bool:
    """Asks this process to end when the one that began it by `start` has died; True if one began it so.

    What it starts itself does not follow in turn, unless it is begun by `start` as well.
    """
    if os.environ.pop(_FOLLOWS, "") != "1":
        return False
    threading.Thread(target=_end_with_parent, name="parent", daemon=True).start()
    return True


def _end_with_parent() -> None:
    while os.read(0, 4096):
        pass
    _ask_myself_to_end()
    time.sleep(GRACE_S)
    os._exit(1)


def _ask_myself_to_end() -> None:
    if sys.platform == "win32":
        signal.raise_signal(signal.SIGBREAK)  # os.kill would end it without asking
    else:
        os.kill(os.getpid(), signal.SIGTERM)
