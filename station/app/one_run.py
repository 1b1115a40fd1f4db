"""One recorded run beside its simulations, before and after what was found, for the report of a diagnosis."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from shared.errors import UserError
from shared.rig import RigConfig
from station.app.simulating import rig_of
from station.diagnosis.result import Diagnosis
from station.friction.onset import estimate_onset
from station.pages.caption import Caption
from station.pages.motion import Moving, moving_figure
from station.physics.catalogue import Catalogue, catalogue_of_table
from station.physics.contact import Array
from station.physics.model import Model, model_of_table
from station.recording.arrays import load_signals
from station.recording.reader import open_recording
from station.signals.session import Signals
from station.signals.tracks import Times
from station.simulators.errors import errors
from station.simulators.levelled import levelled
from station.simulators.recorded_runs import RecordedRun, poses_of, recorded_runs
from station.simulators.rerun import some_runs
from station.simulators.simulator import simulator

_ENGINE = "planar"
"""The simulator of the drawing, whatever the diagnosis simulates again: its friction is that of the fit itself."""
_TRIED = 9
"""The number of runs, spread over the session, of which the middle one is shown: their levels are sought for both
models, which takes some seconds (`station diagnose sim.mcap --report page.html`)."""
_BEFORE_S, _AFTER_S, _SHOWN_S = 0.15, 0.2, 6.0
_RECORDED, _PLAIN, _FOUND = "#0072b2", "#777777", "#009e73"
_MOVED_M = 1e-3
"""A block that has gone this far slides: a camera's sag moves it by less."""


def run_in_motion(path: Path, diagnosis: Diagnosis, *, rig_path: Path | None = None) -> str:
    """Gives the drawing of a typical run of a recording, for its report; empty where no run can be simulated again."""
    if diagnosis.verdict == "untestable":
        return ""
    reader = open_recording(path)
    try:
        rig = rig_of(reader, path=rig_path)
        return typical_run(load_signals(reader), diagnosis, rig=rig, known=catalogue_of_table(rig.physics))
    except UserError:
        return ""


def typical_run(recorded: Signals, diagnosis: Diagnosis, *, rig: RigConfig, known: Catalogue) -> str:
    """Returns a drawing of the run whose path error with the plain model is the middle one; empty where no run slid.

    Each run is simulated at its own level of friction, as where a path's error is told: with the mean friction about
    half the blocks would hold, as a recorded tilt ends once its block has slid.

    Raises:
        UserError: if the recording lacks what a simulation needs.
    """
    some = some_runs(recorded, _TRIED)
    plain = _at_own_level(some, Model(mu_s=diagnosis.mu_s.value), rig=rig)
    found = errors(some, plain)
    slid = np.flatnonzero(np.isfinite(found.path_mm))
    if not len(slid):
        return ""
    middle = slid[np.argsort(found.path_mm[slid])[len(slid) // 2]]
    parts = [("recorded", some, _RECORDED), ("simulated, plain", plain, _PLAIN)]
    if diagnosis.names:
        after = _at_own_level(some, model_of_table(diagnosis.model, known), rig=rig)
        parts.append(("simulated with what was found", after, _FOUND))
    return _drawn(parts, recorded_runs(some)[int(middle)], rig=rig)


def _at_own_level(recorded: Signals, model: Model, *, rig: RigConfig) -> Signals:
    engine = simulator(_ENGINE)
    simulated = engine.repeat(recorded, model, rig=rig)
    return levelled(recorded, simulated, model, rig=rig, engine=engine, reading=estimate_onset)


def _drawn(parts: list[tuple[str, Signals, str]], run: RecordedRun, *, rig: RigConfig) -> str:
    tracks = [(name, poses_of(part).between(run.tilt_ns, run.end_ns), colour) for name, part, colour in parts]
    tracks = [track for track in tracks if len(track[1].time_ns) > 1]
    moves = [moved for _, poses, _ in tracks if (moved := _moving_ns(poses.time_ns, poses.pose))]
    if not moves:
        return ""
    begin_ns, end_ns = min(first for first, _ in moves), max(last for _, last in moves)
    lasts_s = (end_ns - begin_ns) * 1e-9 + _BEFORE_S + _AFTER_S
    blocks = [
        Moving(
            name=name,
            colour=colour,
            time_s=(poses.time_ns - begin_ns).astype(np.float64) * 1e-9 + _BEFORE_S,
            pose=poses.pose,
            filled=colour == _RECORDED,
        )
        for name, poses, colour in tracks
    ]
    caption = Caption(
        shows=f"Run {run.run} from above, {lasts_s:.2g} s shown in {_SHOWN_S:g} s: the middle one of {_TRIED} by the "
        f"path error of the plain model. Simulations are by the {_ENGINE} simulator of the fit, each at the run's own "
        "level of friction, with which the block sets off when the recorded one did. The bar is the scale.",
        count="1 run",
    )
    return moving_figure(blocks, size_m=rig.block.size_m[:2], lasts_s=lasts_s, shown_s=_SHOWN_S, caption=caption)


def _moving_ns(time_ns: Times, pose: Array) -> tuple[int, int] | None:
    """Gives the first and the last moment, ns, at which a block with poses (n, 3) has left its first and last place."""
    gone = np.hypot(*(pose[:, :2] - pose[0, :2]).T) > _MOVED_M
    left = np.hypot(*(pose[:, :2] - pose[-1, :2]).T) > _MOVED_M
    if not (gone.any() and left.any()):
        return None
    first, last = int(np.argmax(gone)), len(left) - 1 - int(np.argmax(left[::-1]))
    return int(time_ns[first]), max(int(time_ns[last]), int(time_ns[first]))
