"""Progress of long work in a log or a pipe: a line now and then, with the time that is left."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager, nullcontext

from rich.console import Console

EVERY_S = 10.0
"""Seconds between two lines, in a log or a pipe: as long as one waits without wondering."""

MINUTES_FROM_S = 120.0
"""Seconds from which on a time is told in minutes."""


class ProgressLines:
    """Prints how many (of `what`) are done, how long it took and how long the rest takes; nothing on a terminal."""

    def __init__(
        self,
        console: Console,
        *,
        total: int,
        what: str = "samples",
        seconds: Callable[[], float] = time.monotonic,
    ) -> None:
        self._console, self._total, self._what, self._seconds = console, total, what, seconds
        self._begin = self._last = seconds()

    def at(self, done: int) -> None:
        """Shows that `done` of them are there."""
        now = self._seconds()
        if self._console.is_terminal or now - self._last < EVERY_S:
            return
        self._last, passed = now, now - self._begin
        left = (
            f"about {duration_text(passed / done * (self._total - done))} left" if done else "time left not known yet"
        )
        self._console.print(f"{done} of {self._total} {self._what} in {passed_text(passed)}, {left}", soft_wrap=True)


@contextmanager
def stages(
    console: Console, first: str, *, seconds: Callable[[], float] = time.monotonic, every_s: float = EVERY_S
) -> Generator[Callable[[str], None]]:
    """Gives a function that shows the stage of long work: in place on a terminal, elsewhere as a line every so often.

    The lines come from a thread, as one stage may take longer than one waits without wondering.
    """
    began, stage = seconds(), first

    def tell() -> None:
        console.print(f"{stage}, {passed_text(seconds() - began)} so far", markup=False, soft_wrap=True)

    def show(name: str) -> None:
        nonlocal stage
        stage = name
        status.update(name)

    with console.status(first) as status, nullcontext() if console.is_terminal else _repeating(tell, every_s=every_s):
        yield show


def passed_text(seconds: float) -> str:
    """Returns a time that has passed in words, to the second: two lines that said the same would be two stages."""
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if rest and seconds >= MINUTES_FROM_S else duration_text(seconds)


def duration_text(seconds: float) -> str:
    """Returns a duration in words: seconds, or whole minutes from two of them on."""
    return f"{seconds:.0f} s" if seconds < MINUTES_FROM_S else f"{seconds / 60:.0f} min"


@contextmanager
def looked_at(look: Callable[[], None], *, every_s: float) -> Generator[None]:
    """Calls `look` every so often while the block waits for other processes, and once more at its end."""
    with _repeating(look, every_s=every_s):
        yield
        look()


@contextmanager
def _repeating(do: Callable[[], None], *, every_s: float) -> Generator[None]:
    """Calls `do` every so often, in a thread of its own, which ends with the block."""
    over = threading.Event()

    def keep_doing() -> None:
        while not over.wait(every_s):
            do()

    doing = threading.Thread(target=keep_doing, name="progress", daemon=True)
    doing.start()
    try:
        yield
    finally:
        over.set()
        doing.join()
