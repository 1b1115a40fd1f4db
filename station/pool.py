"""The one pool: work on many things in processes of this machine, or on a cluster that the caller has set up.

All that works on many things comes here: the commands, the study, the proof. A process has one thread for linear
algebra. It leaves Ctrl-C to its parent, which ends it, and ends by itself when its parent was killed. The backend is
joblib's: the one that `joblib.parallel_config` was told of, or else processes of this machine.
"""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from multiprocessing import resource_tracker
from typing import Any, TypeVar

from joblib import Parallel, delayed, parallel_config
from joblib.externals.loky.backend.resource_tracker import ensure_running
from joblib.parallel import LokyBackend, get_active_backend
from threadpoolctl import threadpool_limits

from shared.system.processes import usable_processors
from shared.system.signals import CAN_HOLD, ctrl_c_held

Task = TypeVar("Task")
Result = TypeVar("Result")
LOOK_S = 1.0
"""The time between two looks of a process at its parent."""
_ROUND = 64
"""The tasks of a round where a backend (Ray's) answers only when all are done: fewer leave its workers idle."""


@contextmanager
def spread(
    work: Callable[[Task], Result], tasks: Iterable[Task], *, jobs: int = 0, in_order: bool = True
) -> Generator[Iterator[Result]]:
    """Provides the results of `work` on every task as they come: in the tasks' order, or each as soon as it is done.

    The first error is raised as soon as it is known. It ends the processes, as does leaving the block, and loses what
    they were at: so a task writes each of its files whole, or not at all.

    Args:
        work: a function of a module, or a `partial` of one; what it takes and returns can be pickled.
        tasks: the arguments that it is called with, one at a time.
        jobs: the number of processes; 0: one for each core. With 1, or a single task, no other process is started. A
            cluster uses all its workers, unless it is 1.
        in_order: False to get each result as soon as it is done.
    """
    waiting = list(tasks)
    backend: Any = get_active_backend()[0]
    here = isinstance(backend, LokyBackend)
    jobs = min(jobs or usable_processors(), len(waiting)) if here else jobs
    if jobs == 1 or not waiting:
        yield map(work, waiting)
        return
    results = _here(work, waiting, jobs, in_order) if here else _elsewhere(backend, work, waiting, in_order)
    try:
        yield results
    finally:
        results.close()


@contextmanager
def on_backend(name: str, **settings: Any) -> Generator[None]:
    """Makes `spread` use this backend of joblib's within the block."""
    with parallel_config(name, **settings):
        yield


def _here(work: Any, waiting: list[Any], jobs: int, in_order: bool) -> Generator[Any]:
    with parallel_config("loky", inner_max_num_threads=1, initializer=_begin, initargs=(os.getpid(),)):
        pool: Any = Parallel(n_jobs=jobs, return_as=_return_as(in_order))
    # A process that is still importing would answer Ctrl-C with a traceback.
    with _deaf():
        return pool(delayed(work)(task) for task in waiting)


@contextmanager
def _deaf() -> Generator[None]:
    """Starts within the block processes that never hear Ctrl-C.

    The trackers of shared memory, Python's and joblib's, are begun before: their start lets Ctrl-C through again.
    """
    if CAN_HOLD:
        resource_tracker.ensure_running()
        ensure_running()
    with ctrl_c_held():
        yield


def _elsewhere(backend: Any, work: Any, waiting: list[Any], in_order: bool) -> Generator[Any]:
    calls = [delayed(partial(_with_one_thread, work))(task) for task in waiting]
    if backend.supports_return_generator:
        pool: Any = Parallel(n_jobs=-1, return_as=_return_as(in_order))
        return pool(calls)
    return _in_rounds(calls)


def _return_as(in_order: bool) -> str:
    return "generator" if in_order else "generator_unordered"


def _in_rounds(calls: list[Any]) -> Generator[Any]:
    with Parallel(n_jobs=-1) as pool:
        for first in range(0, len(calls), _ROUND):
            yield from pool(calls[first : first + _ROUND])


def _with_one_thread(work: Callable[[Task], Result], task: Task) -> Result:
    """Does a task in one thread: whoever started a worker of a cluster may have left it all threads."""
    with threadpool_limits(limits=1):
        return work(task)


def _begin(parent: int) -> None:
    """Begins a process of ours: Ctrl-C, which reaches it as well, is its parent's matter."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    """Ends this process after its parent: it would otherwise go on with the task of a command that was killed."""
    while os.getppid() == parent:
        time.sleep(LOOK_S)
    os._exit(1)
