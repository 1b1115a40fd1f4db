"""Work on many cases with all cores: in processes of one thread each, with a bar, and safe to break off."""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Generator, Iterable, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any, TypeVar

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
Json = Mapping[str, Any]
Task = TypeVar("Task")


def bar(console: Console) -> Progress:
    """A bar with the time left."""
    return Progress(
        TextColumn("{task.description:<28}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=console,
    )


def write_json(path: Path, value: Json) -> None:
    """Writes the whole file or nothing, so that a run that was broken off leaves no half of a result."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(path.name + ".partial")
    partial.write_text(json.dumps(value, indent=1) + "\n", encoding="utf-8")
    os.replace(partial, path)


def work_on(tasks: Iterable[Task], work: Callable[[Task], None], *, jobs: int, title: str, console: Console) -> None:
    """Calls `work` on every task; each call writes its own result.

    Ctrl-C: the cases at hand are finished, the rest is left for the next call.
    """
    waiting = list(tasks)
    if not waiting:
        return
    with (
        _one_thread_each(),
        bar(console) as progress,
        ProcessPoolExecutor(
            max_workers=min(jobs, len(waiting)), mp_context=multiprocessing.get_context("spawn"), initializer=_deaf
        ) as pool,
    ):
        shown = progress.add_task(title, total=len(waiting))
        futures = [pool.submit(work, task) for task in waiting]
        try:
            for future in as_completed(futures):
                future.result()
                progress.advance(shown)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            progress.console.print("Stopping after the cases at hand; the same command goes on from here.")
            raise


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


def _deaf() -> None:
    """A worker finishes its case when the terminal says stop, and ends at once with a process that was killed.

    A result is whole or not there, either way.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """Otherwise it would wait for ever for work, on a pipe of which it holds both ends."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
