"""Recordings of the concealed generator whose arm reports its attitude with noise, and its rates filtered."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.spatial.transform import Rotation

from shared.geometry import Array
from station.recording.arrays import load_signals
from station.recording.reader import open_recording
from station.signals.session import Signals
from tests.concealed.design import Design, Nuisance, Setting
from tests.concealed.files import rig_toml, write_session
from tests.concealed.session import run_session
from tests.concealed.world import NULL, World

GAP_NS = 50_000_000


@dataclass(frozen=True, kw_only=True)
class Arm:
    """The reports of an arm: white noise of a reading (rad, about each axis), and over how long its rates are means."""

    noise_rad: float = 0.0
    filtered_s: float = 0.0


def concealed(folder: Path, *, seed: int, runs: int, world: World = NULL) -> tuple[Signals, Path]:
    """A session with an exact attitude, 10 % of scatter and .1 px of noise, and its rig file."""
    setting = Setting(design=Design(runs=runs), nuisance=Nuisance(scatter=0.1, noise_px=0.1), world=world)
    rng = np.random.default_rng(seed)
    session = run_session(setting, rng)
    rig, path = folder / f"{seed}.toml", folder / f"{seed}.mcap"
    text = rig_toml(setting, mu_guess=0.35, scatter_guess=0.1)
    rig.write_text(text, encoding="utf-8")
    write_session(session, path, rig=text, rng=rng)
    return load_signals(open_recording(path)), rig


def reported(signals: Signals, arm: Arm, *, seed: int) -> Signals:
    """The same session by another arm; the numbers of its samples stay those of the exact one."""
    attitude, rng = signals.attitude, np.random.default_rng(seed)
    turn = Rotation.from_quat(attitude.quaternion, scalar_first=True)
    noisy = turn * Rotation.from_rotvec(arm.noise_rad * rng.standard_normal((len(attitude), 3)))
    rate = attitude.rate_rad_s.copy()
    if arm.filtered_s > 0.0:
        edges = [0, *(np.flatnonzero(np.diff(attitude.time_ns) > GAP_NS) + 1).tolist(), len(rate)]
        for first, last in pairwise(edges):
            time_s = (attitude.time_ns[first:last] - attitude.time_ns[first]) * 1e-9
            rate[first:last] = _mean_before(time_s, rate[first:last], arm.filtered_s)
    changed = replace(attitude, quaternion=noisy.as_quat(scalar_first=True), rate_rad_s=rate)
    return replace(signals, attitude=changed)


def _mean_before(time_s: Array, rate: Array, length_s: float) -> Array:
    """The means (n, 3) of rates over the time before each; they run straight between readings, and begin with none."""
    turned = np.asarray(cumulative_trapezoid(rate, time_s, axis=0, initial=0.0))
    before = [np.interp(time_s - length_s, time_s, column, left=0.0) for column in turned.T]
    return (turned - np.column_stack(before)) / length_s
