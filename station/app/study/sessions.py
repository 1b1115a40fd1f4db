"""Simulates the study's sessions with all cores, in processes of one session each, and keeps those that are whole.

A recording grows in the folder `unfinished` and is moved when its session has come to its end. So whatever breaks the
study off (Ctrl-C, kill -9, a power cut), the next call finds whole sessions and does the others anew.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from rich.console import Console

from shared.clock import SIMULATION_EPOCH_NS
from shared.errors import UserError
from station.app import recordings
from station.app.bars import LOOK_S, bar
from station.app.lockstep import Lockstep
from station.app.progress import ProgressLines, looked_at
from station.app.study.design import Part, place_of, plan_of
from station.app.study.essentials import LEFT_OUT, Essentials
from station.app.study.rigs import rig_of
from station.pool import spread
from station.recording.reader import open_recording

FLUSH_S = 10.0
"""Simulated: what a killed session loses does not matter here, it is done anew."""


def whole(part: Part) -> bool:
    """Returns true if the session was simulated already.

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
    for part in todo:
        _counter(part).unlink(missing_ok=True)
    total = sum(part.samples for part in todo)
    lines = ProgressLines(console, total=total)
    with bar(console) as progress:
        shown = progress.add_task(f"samples, {len(todo)} sessions to do", total=total)

        def look() -> None:
            done = sum(map(_finished, todo))
            progress.update(shown, completed=done)
            lines.at(done)

        try:
            with looked_at(look, every_s=LOOK_S), spread(simulate, todo, jobs=jobs, in_order=False) as whole_ones:
                for _ in whole_ones:
                    pass
        except BaseException:
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
        outcome = session.run(on_sample=partial(_count, _counter(part)))
    if outcome.fault:
        raise UserError(f"{growing}: expected {part.samples} samples, got {outcome.samples}: {outcome.fault}")
    os.replace(growing, part.path)
    _counter(part).unlink()


def tidy(folder: Path) -> None:
    """Removes the folder of unfinished recordings once nothing is in it."""
    unfinished = folder / "unfinished"
    if unfinished.is_dir() and not any(unfinished.iterdir()):
        unfinished.rmdir()


def _counter(part: Part) -> Path:
    """Returns a file that has a byte for each sample of a growing session.

    Whoever looks on counts them without a pipe.
    """
    return part.unfinished_path.with_suffix(".samples")


def _count(counter: Path, _samples: int) -> None:
    with counter.open("ab") as file:
        file.write(b".")


def _finished(part: Part) -> int:
    """Returns the samples of a session that are done."""
    try:
        return _counter(part).stat().st_size
    except FileNotFoundError:  # it has not begun, or it is whole
        return part.samples if part.path.exists() else 0
