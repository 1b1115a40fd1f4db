"""Work on many cases with all cores, or with more machines by joblib's backends; it can be broken off."""

from __future__ import annotations

import contextlib
import os
import threading
import time
from collections.abc import Callable, Generator, Iterable
from functools import cache
from typing import Any, TypeVar

from joblib import Parallel, delayed
from rich.console import Console

from station.app.work import THREADS, bar

Task = TypeVar("Task")
LOOK_S = 1.0
"""The time between two looks of a worker at its parent."""


def work_on(tasks: Iterable[Task], work: Callable[[Task], None], *, jobs: int, title: str, console: Console) -> None:
    """Calls `work` on every task, in any order; each call writes its own result, whole or not at all.

    The backend is joblib's: processes of this machine, or what the caller has set up by `joblib.parallel_config` (Dask
    or Ray, say), whose workers see the same folders. Ctrl-C leaves the cases at hand to the next call.
    """
    waiting = list(tasks)
    if not waiting:
        return
    with _one_thread_each(), bar(console) as progress:
        shown = progress.add_task(title, total=len(waiting))
        pool: Any = Parallel(n_jobs=min(jobs, len(waiting)), return_as="generator_unordered")
        try:
            for _ in pool(delayed(_followed)(work, task, os.getpid()) for task in waiting):
                progress.advance(shown)
        except BaseException:
            progress.console.print("Stopped; the same command goes on from here.")
            raise


def _followed(work: Callable[[Task], None], task: Task, caller: int) -> None:
    """The work, in a process that ends with its parent, where it is another one than the caller's."""
    if os.getpid() != caller:
        _follow_parent(os.getppid())
    work(task)


@cache
def _follow_parent(parent: int) -> None:
    """Otherwise a worker of a command that was killed would go on with its case."""
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(LOOK_S)
    os._exit(1)


@contextlib.contextmanager
def _one_thread_each() -> Generator[None]:
    """Processes that are started meanwhile get one thread; this process's own environment is what it was afterwards."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
