"""The effect of a simulation's settings, apart from physics: creep of the solver, artefact of the cone.

A handful of the recorded tilts is simulated with the user's settings and with refined ones, in our world or in a scene
of the user's own. What changes is not physics, and the first of a list of cures that removes nine tenths of it is
named. With MuJoCo's defaults a block of
friction 0.36 seems to start 8° early on a ramp of 3°/s, and the pyramidal cone takes 4° off the friction angle at 45°.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from shared.errors import UserError
from shared.rig import RigConfig
from station.physics.contact import GRAVITY_M_S2, Array
from station.physics.model import Model
from station.signals.session import Signals
from station.simulators.artefacts import said
from station.simulators.mujoco.batch import SHARE_CREEPING, simulate
from station.simulators.mujoco.contact import MUJOCO_DEFAULT
from station.simulators.mujoco.tilted import Setup
from station.simulators.planar.commands import Commands, ramps
from station.simulators.planar.session import commands_of
from station.simulators.recorded_runs import recorded_runs

BASELINE = Setup(contact=MUJOCO_DEFAULT, solid=True)
"""The settings of a user who changes nothing: a box on a plane, with MuJoCo's own contact."""
RUNS = 4
READ_M = 5e-4
"""A block that has moved this far counts as started."""
NEAR = 0.9
DIRECTIONS_RAD = tuple(math.radians(angle) for angle in (0.0, 22.5, 45.0))
LEAST_DEG, LEAST_MM = 0.1, 0.1
"""Smaller changes are not reported."""
_CURED = 0.1
_STAMP_S = 0.01
_LOOKED_S = (0.02, 0.05, 0.08)


@dataclass(frozen=True, kw_only=True)
class Cure:
    """A change of the settings, by MuJoCo's names."""

    text: str
    setup: Setup


def cures(baseline: Setup) -> tuple[Cure, ...]:
    """Returns the possible cures, from the smallest change to the largest, which is the refined simulation."""
    round_one = replace(baseline, contact=replace(baseline.contact, elliptic=True))
    # A contact that is pushed apart by its own friction would hop: see contact.py.
    firm = replace(round_one, contact=replace(round_one.contact, impratio=max(100.0, baseline.contact.impratio)))
    text = 'cone="elliptic", impratio="100"'
    return (
        Cure(text="half the time step", setup=replace(baseline, step_s=0.5 * baseline.step_s)),
        Cure(text='cone="elliptic"', setup=round_one),
        Cure(text=text, setup=firm),
        Cure(text=f'{text}, noslip_iterations="3"', setup=replace(firm, noslip=3)),
        Cure(text=f"{text}, half the time step", setup=replace(firm, step_s=0.5 * baseline.step_s)),
    )


Simulated = Callable[[Commands, Array], Array]
"""The poses (n, m, 3) of n runs at times (m,), s."""


@dataclass(frozen=True, kw_only=True)
class Tried:
    """Settings to try, in words, and what simulates tilts and slides with them; a slide is on feet that do not hop."""

    text: str
    tilted: Simulated
    sliding: Simulated


def numerics(
    recorded: Signals, *, rig: RigConfig, mu_s: float, baseline: Setup = BASELINE, runs: int = RUNS
) -> list[dict[str, Any]]:
    """Returns the effect of a simulation's settings on a few of the recorded tilts.

    Each thing is a dict of id, meant, size, unit, cured_by, before and after.

    Args:
        recorded: the session.
        rig: sizes of block and plate.
        mu_s: friction to simulate with.
        baseline: the user's settings.
        runs: how many of the recorded tilts.

    Raises:
        UserError: if the recording lacks what a simulation needs.
    """
    return checks(some_tilts(recorded, rig=rig, runs=runs), mu_s=mu_s, baseline=baseline)


def some_tilts(recorded: Signals, *, rig: RigConfig, runs: int = RUNS) -> Commands:
    """Returns the commands of a few of the recorded tilts, evenly spread.

    Raises:
        UserError: if there are none, or the recording lacks what a simulation needs.
    """
    every = [run for run in recorded_runs(recorded) if not run.velocity.any()]
    if not every:
        raise UserError("Expected at least one recorded tilt to try the simulation's settings on, found none")
    chosen = [every[index] for index in np.unique(np.linspace(0, len(every) - 1, runs).round().astype(int)).tolist()]
    return commands_of(recorded, chosen, rig=rig)


def checks(commands: Commands, *, mu_s: float, baseline: Setup = BASELINE) -> list[dict[str, Any]]:
    """Returns the checks of `numerics`, on given tilts."""
    own = Cure(text="as it is", setup=baseline)
    return checked(commands, [_tried(cure, mu_s) for cure in (own, *cures(baseline))], mu_s=mu_s)


def checked(commands: Commands, tried: Sequence[Tried], *, mu_s: float, pyramid: bool = True) -> list[dict[str, Any]]:
    """Returns the checks of `numerics` on given tilts; the user's settings come first, refined ones last.

    Without a `pyramid` for a cone there is no artefact of one.
    """
    return [*_creep(commands, tried), *(_cone(commands, tried, mu_s) if pyramid else [])]


def _tried(cure: Cure, mu_s: float) -> Tried:
    model = Model(mu_s=mu_s)
    return Tried(
        text=cure.text,
        tilted=lambda commands, times: (
            simulate(commands, model, time_s=times, setup=cure.setup, share=SHARE_CREEPING).path
        ),
        sliding=lambda commands, times: (
            simulate(commands, model, time_s=times, setup=replace(cure.setup, solid=False)).path
        ),
    )


# --- creep ----------------------------------------------------------------------------------------------------------


def _creep(commands: Commands, tried: Sequence[Tried]) -> list[dict[str, Any]]:
    """Returns the finding of creep.

    It has the apparent advance of the onset over the refined settings, and the way crept before.
    """
    commands = replace(commands, border_m=math.inf, outline_m=())
    refined, before = (_readings(commands, settings) for settings in (tried[-1], tried[0]))
    early, crept = _change(before, refined)
    if not (early > LEAST_DEG or crept > LEAST_MM):
        return []
    cured = tried[-1].text
    for cure in tried[1:-1]:
        left_deg, left_mm = _change(_readings(commands, cure), refined)
        if abs(left_deg) <= max(_CURED * early, LEAST_DEG) and left_mm <= max(_CURED * crept, 0.5 * LEAST_MM):
            cured = cure.text
            break
    onsets = (float(np.degrees(np.nanmean(each.onset_rad))) for each in (before, refined))
    ways = (float(1e3 * each.crept_m(refined).mean()) for each in (before, refined))
    return [
        _said("solver_creep", early, "deg", cured, onsets),
        _said("solver_creep", crept, "mm", cured, ways),
    ]


@dataclass(frozen=True, eq=False, kw_only=True)
class _Reading:
    """The tilt (n,) at which blocks are seen to start, and how far (n, m) they are from their start."""

    commands: Commands
    time_s: Array
    onset_rad: Array
    away_m: Array

    def crept_m(self, refined: _Reading) -> Array:
        """Gives the way (n,), m, of each block when the tilt first is NEAR of the one where the refined one starts."""
        tilt = np.stack([_tilt_along(self.commands, row, self.time_s) for row in range(len(self.away_m))])
        due = np.tan(tilt) >= NEAR * np.tan(refined.onset_rad)[:, None]
        found = due.any(axis=1)
        away = self.away_m[np.arange(len(due)), due.argmax(axis=1)]
        return np.where(found, away, 0.0)[found] if found.any() else np.zeros(1)


def _readings(commands: Commands, settings: Tried) -> _Reading:
    times = np.arange(0.0, float(commands.end_s.max()), _STAMP_S)
    path = settings.tilted(commands, times)
    away = np.linalg.norm(path[..., :2] - path[:, :1, :2], axis=2)
    moved = away > READ_M
    at = np.where(moved.any(axis=1), times[moved.argmax(axis=1)], np.nan)
    return _Reading(commands=commands, time_s=times, onset_rad=commands.tilt_at(at), away_m=away)


def _tilt_along(commands: Commands, row: int, times: Array) -> Array:
    """Returns the tilt of one run at times (m,)."""
    return np.interp(times, commands.time_s[row], commands.tilt_rad[row])


def _change(before: _Reading, refined: _Reading) -> tuple[float, float]:
    """Returns the advance of the onset (deg) and the additional creep (mm) against the refined settings."""
    both = np.isfinite(before.onset_rad) & np.isfinite(refined.onset_rad)
    early = float(np.degrees((refined.onset_rad - before.onset_rad)[both].mean())) if both.any() else 0.0
    return early, 1e3 * float(before.crept_m(refined).mean() - refined.crept_m(refined).mean())


# --- the cone -------------------------------------------------------------------------------------------------------


def _cone(commands: Commands, tried: Sequence[Tried], mu_s: float) -> list[dict[str, Any]]:
    """Returns the spread of friction between three directions of sliding, as angles.

    It is measured in motion, because a block that creeps has no onset to compare, and on even feet, because a box that
    hops has none either.
    """

    def spread_deg(settings: Tried) -> float:
        return float(np.ptp(_sliding_deg(commands, mu_s, settings)))

    before, after = spread_deg(tried[0]), spread_deg(tried[-1])
    if not before - after > LEAST_DEG:
        return []
    left = ((cure.text, spread_deg(cure)) for cure in tried[1:-1])
    cured = next((text for text, apart in left if apart - after <= max(_CURED * before, LEAST_DEG)), tried[-1].text)
    return [_said("cone_artifact", before - after, "deg", cured, (before, after))]


def _sliding_deg(commands: Commands, mu_s: float, settings: Tried) -> Array:
    """Returns the friction angle that slows blocks on the level plate in each of DIRECTIONS_RAD."""
    way = np.array(DIRECTIONS_RAD)
    velocity = np.column_stack([np.cos(way), np.sin(way), 0.0 * way])
    # The speed is so high that none stops within the time looked at, at which the feet have settled.
    velocity *= 1.5 * mu_s * GRAVITY_M_S2 * _LOOKED_S[-1]
    level = ramps(
        (0.0, _LOOKED_S[-1] + 0.02),
        (0.0, 0.0),
        downhill_rad=way,
        velocity=velocity,
        mass_kg=commands.mass_kg[0],
        area_m2=commands.area_m2[0],
    )
    path = settings.sliding(level, np.array(_LOOKED_S))
    first, middle, last = np.linalg.norm(path[..., :2], axis=2).T
    slowed = (2.0 * middle - first - last) / (_LOOKED_S[1] - _LOOKED_S[0]) ** 2
    return np.degrees(np.arctan(slowed / GRAVITY_M_S2))


def _said(name: str, size: float, unit: str, cured_by: str, figures: Any) -> dict[str, Any]:
    before, after = figures
    return said(name, size, unit, cured_by=cured_by, before=before, after=after)
