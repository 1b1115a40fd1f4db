"""Simulates the study's sessions with all cores, in processes of one session each, and keeps those that are whole.

A recording grows in the folder `unfinished` and is moved when its session has come to its end. So whatever breaks the
study off (Ctrl-C, kill -9, a power cut), the next call finds whole sessions and does the others anew.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Sequence
from concurrent.futures import FIRST_EXCEPTION, ProcessPoolExecutor, wait
from multiprocessing import connection
from multiprocessing.sharedctypes import Synchronized
from pathlib import Path

from rich.console import Console

from shared.clock import SIMULATION_EPOCH_NS
from shared.errors import UserError
from station.app import recordings
from station.app.lockstep import Lockstep
from station.app.progress import Told
from station.app.study.design import Part, place_of, plan_of
from station.app.study.essentials import LEFT_OUT, Essentials
from station.app.study.rigs import rig_of
from station.app.work import THREADS, bar
from station.recording.reader import open_recording

LOOK_S = 0.5
FLUSH_S = 10.0
"""Simulated: what a killed session loses does not matter here, it is done anew."""
_done: Synchronized[int] | None = None
"""Samples that all the workers have finished; each worker has it from its birth."""


def whole(part: Part) -> bool:
    """True if the session was simulated already.

    Raises:
        UserError: if its recording is of another study: another seed, number of samples or rig.
    """
    if not part.path.exists():
        return False
    attached = open_recording(part.path).attachments
    expected = {"rig.toml": rig_of(part.pair).text, "plan.toml": recordings.plan_toml(plan_of(part))}
    if any(attached.get(name, b"").decode() != text for name, text in expected.items()):
        raise UserError(
            f"Expected a session of this study in {part.path}, but it has another seed, plan or rig; give --samples "
            "and --seed as they were when the study was begun, or another folder with --out"
        )
    return True


def simulate_all(parts: Sequence[Part], *, jobs: int, console: Console) -> int:
    """Simulates the sessions that are not there yet, and gives their number. Ctrl-C leaves those that are whole."""
    todo = [part for part in parts if not whole(part)]
    if not todo:
        return 0
    todo[0].unfinished_path.parent.mkdir(parents=True, exist_ok=True)
    os.environ.update(dict.fromkeys(THREADS, "1"))
    context = multiprocessing.get_context("spawn")
    done: Synchronized[int] = context.Value("i", 0)
    with (
        bar(console) as progress,
        ProcessPoolExecutor(min(jobs, len(todo)), mp_context=context, initializer=_begin, initargs=(done,)) as pool,
    ):
        total = sum(part.samples for part in parts)
        before = total - sum(part.samples for part in todo)
        shown = progress.add_task(f"samples, {len(todo)} sessions to do", total=total - before)
        told = Told(console, total=total - before)
        waiting = {pool.submit(simulate, part) for part in todo}
        try:
            while waiting:
                finished, waiting = wait(waiting, timeout=LOOK_S, return_when=FIRST_EXCEPTION)
                for one in finished:
                    one.result()
                progress.update(shown, completed=done.value)
                told.at(done.value)
        except BaseException:
            for process in multiprocessing.active_children():
                process.terminate()
            pool.shutdown(wait=False, cancel_futures=True)
            progress.console.print("Broken off; the same command goes on with the sessions that are not whole.")
            raise
    return len(todo)


def simulate(part: Part) -> None:
    """Simulates one session and moves its recording to its place.

    Raises:
        UserError: if the session stopped before its plan was carried out.
    """
    rig, plan = rig_of(part.pair), plan_of(part)
    growing = part.unfinished_path
    growing.parent.mkdir(parents=True, exist_ok=True)
    origin = recordings.provenance(rig, plan, mode="lockstep", started_ns=SIMULATION_EPOCH_NS)
    recording = Essentials(growing, provenance=origin, overwrite=True, flush_every_s=FLUSH_S)
    with recording:
        recording.describe()
        session = Lockstep(rig, plan, recording=recording, left_out=LEFT_OUT)
        session.twin.world.place_block(*place_of(part), part.yaw_rad)
        outcome = session.run(on_sample=_count)
    if outcome.fault:
        raise UserError(f"{growing}: expected {part.samples} samples, got {outcome.samples}: {outcome.fault}")
    os.replace(growing, part.path)


def tidy(folder: Path) -> None:
    """Removes the folder of unfinished recordings once nothing is in it."""
    unfinished = folder / "unfinished"
    if unfinished.is_dir() and not any(unfinished.iterdir()):
        unfinished.rmdir()


def _begin(done: Synchronized[int]) -> None:
    """A worker leaves Ctrl-C to its parent, which ends it, and ends by itself when its parent is killed."""
    global _done  # noqa: PLW0603 (a value shared by processes can only be handed over at a worker's birth)
    _done = done
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """Without this a killed study's workers would go on, beside those of the call that goes on with it."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)


def _count(_samples: int) -> None:
    if _done is not None:
        with _done.get_lock():
            _done.value += 1
