"""A process of its own for a user's function: one that hangs or crashes ends alone.

The process reads pickled questions from what was its standard input and writes pickled answers to what was its standard
output. What the function prints goes to standard error, and it finds nothing to read.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import weakref
from pathlib import Path
from typing import IO, Any

from shared.errors import UserError
from station.physics.model import Model
from station.simulators.planar.commands import Commands
from station.simulators.yours.answer import Answer
from station.simulators.yours.function import called, loaded, takes_found

START_S = 120.0
"""Importing the user's file may take so long: a graphics or learning library takes half a minute on a busy machine."""


MOST_STATUSES = 256
"""The number of exit statuses that a program gives itself."""


class Child:
    """A function of a Python file in another process, which is ended with `close` or when it is late."""

    def __init__(self, path: Path, name: str, *, limit_s: float) -> None:
        """Starts the process and imports the file.

        Raises:
            UserError: if that fails.
        """
        self._function, self._limit_s = f"{path}:{name}", min(limit_s, threading.TIMEOUT_MAX)
        words = [sys.executable, "-m", "station.simulators.yours.child", str(path), name]
        here = str(Path(__file__).parents[3])
        paths = os.pathsep.join([here, *filter(None, [os.environ.get("PYTHONPATH")])])
        self._process = subprocess.Popen(
            words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env={**os.environ, "PYTHONPATH": paths}
        )
        self.close = weakref.finalize(self, _end, self._process)
        """Ends the process; so does the end of whoever holds this."""
        self._answers: queue.Queue[Any] = queue.Queue()
        threading.Thread(target=_listen, args=(self._process.stdout, self._answers), daemon=True).start()
        self.takes_found = bool(self._next(START_S, "importing it"))

    def run(self, commands: Commands, model: Model, friction: float) -> Answer:
        """Simulates one run, as `function.called` says.

        Raises:
            UserError: also for a function that takes longer than the limit, or whose process ends.
        """
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            pickle.dump((commands, model, friction), self._process.stdin)
            self._process.stdin.flush()
        return self._next(self._limit_s, "one run")

    def _next(self, limit_s: float, what: str) -> Any:
        try:
            answer = self._answers.get(timeout=limit_s)
        except queue.Empty:
            self.close()
            raise UserError(
                f"Expected an answer of {self._function} within {limit_s:g} s, but {what} took longer; "
                "make it faster, or give it more time with --simulate-limit"
            ) from None
        if answer is EOFError:
            raise UserError(f"Expected an answer of {self._function}, but {_ended(self._process.wait())}")
        if isinstance(answer, UserError):
            raise answer
        return answer


def _ended(status: int) -> str:
    """Returns how a process ended, in words; a crash has a negative status, and on Windows a large one."""
    if 0 <= status < MOST_STATUSES:
        return (
            f"its process ended with status {status}: what it printed may tell why, or something in it calls os._exit"
        )
    name = next((one.name for one in signal.Signals if one == -status), f"status {status}")
    return f"its process was ended by {name}: a library that it calls crashed, or had too little memory"


def _listen(stream: IO[bytes], answers: queue.Queue[Any]) -> None:
    """Puts every answer into the queue; an exception is an answer, and the end is one, too."""
    with contextlib.suppress(EOFError, pickle.UnpicklingError, ValueError, OSError), stream:
        while True:
            answers.put(pickle.load(stream))
    answers.put(EOFError)


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()
    if process.stdin is not None:
        with contextlib.suppress(OSError):
            process.stdin.close()


def main() -> int:
    """Serves one function until the questions end; 0."""
    questions, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    with Path(os.devnull).open("rb") as nothing:
        os.dup2(nothing.fileno(), 0)  # a function that asks for input is told at once that there is none
    os.dup2(2, 1)
    try:
        function = loaded(Path(sys.argv[1]), sys.argv[2])
    except UserError as error:
        _say(error, answers)
        return 0
    _say(takes_found(function), answers)
    while True:
        try:
            commands, model, friction = pickle.load(questions)
        except EOFError:
            return 0
        try:
            _say(called(function, commands, model, friction), answers)
        except UserError as error:
            _say(UserError(str(error)), answers)


def _say(answer: object, answers: IO[bytes]) -> None:
    pickle.dump(answer, answers)
    answers.flush()


if __name__ == "__main__":
    sys.exit(main())
