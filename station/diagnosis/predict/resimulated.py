"""Simulates held-out slides in the planar simulator, and measures how far they are from the recorded ones.

Each slide begins at the middle of its first window, where its place and speed are known best, and follows the recorded
attitude alone until its evidence ends, on a plate that has come from where its tilt last turned round. It is compared
in the frames after that window. The run's own level of friction is what its onset implies; nothing that the slide shows
after its first window is used.

At a window's end a parabola's slope has four times the error that it has in the middle, and shares that of the
curvature: slides of tossed cubes that began there went astray by their starts, whatever the law
(`pytest -m benchmark -s tests/benchmarks/test_toss_paths.py`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.plate import Times
from station.diagnosis.observations.slide_tracks import SlideTrack
from station.diagnosis.observations.windows import FRAMES
from station.physics.contact import Array, Bools
from station.physics.model import Model
from station.simulators.planar.commands import Commands, tracks
from station.simulators.planar.simulate import Chances, simulate

KNOT_NS = 10_000_000
"""The interval within which the planar simulator turns the plate evenly, as it does with a whole recording."""

NANO = 1e-9
BEGIN = FRAMES // 2
"""The frame of a slide track at which its simulation begins: the middle of its first window."""


@dataclass(frozen=True, eq=False)
class SlideErrors:
    """Errors of each run's simulated slide (r,), root mean squares over its frames or nan: places, m, and yaws, rad."""

    path_m: Array
    turn_rad: Array


def slide_errors(evidence: Evidence, model: Model, runs: Bools, *, run_effects: Array) -> SlideErrors:
    """Returns the errors (r,) of the chosen runs' slides; nan for the others.

    Args:
        evidence: must have `slide_tracks`; without them every error is nan.
        model: friction and effects.
        runs: (r,) True for the runs that are wanted.
        run_effects: (r,) expected log of each run's own friction over the model's; nan where nothing is expected.
    """
    found = SlideErrors(*np.full((2, evidence.runs), np.nan))
    slide_tracks = evidence.slide_tracks
    chosen = () if slide_tracks is None else slide_tracks.of_runs(runs & np.isfinite(run_effects))
    if not chosen:
        return found
    seen = [_unbent(slide, model) for slide in chosen]
    own = np.exp(run_effects[[slide.run for slide in chosen]])
    for slide, pose, again in zip(chosen, seen, _simulated(evidence, chosen, seen, model, own=own), strict=True):
        square = np.square((again[: len(pose) - BEGIN] - pose[BEGIN:])[FRAMES - BEGIN :]).mean(axis=0)
        found.path_m[slide.run], found.turn_rad[slide.run] = np.sqrt([square[0] + square[1], square[2]])
    return found


def _unbent(slide: SlideTrack, model: Model) -> Array:
    """Returns the poses (k, 3) without the shift that the model's camera effects add to their places."""
    pose = slide.pose.copy()
    pose[:, :2] -= model.seen(slide.view).mean(axis=1)
    return pose


def _simulated(
    evidence: Evidence, chosen: Sequence[SlideTrack], seen: Sequence[Array], model: Model, *, own: Array
) -> Array:
    """Returns the poses (n, k, 3) of the simulated slides at their frames from BEGIN on.

    `own` (n,) are factors on friction.
    """
    # Poses are stamped late by the camera's delay, so the attitude is read that much earlier.
    delay_ns = round(model.delay_s() * 1e9)
    punctual = replace(model, terms=tuple(term for term in model.terms if "delay_s" not in term.effect.acts_through()))
    return simulate(
        _commands(evidence, chosen, seen, delay_ns),
        punctual,
        time_s=_padded([_seconds(slide.time_ns[BEGIN:]) for slide in chosen]),
        chances=Chances(friction=own, shake=np.zeros(len(own))),
    ).path


def _commands(evidence: Evidence, chosen: Sequence[SlideTrack], seen: Sequence[Array], delay_ns: int) -> Commands:
    facts, slide_tracks = evidence.facts, evidence.slide_tracks
    run = np.array([slide.run for slide in chosen])
    assert slide_tracks is not None
    knots = [_knots(slide.time_ns[BEGIN:]) for slide in chosen]
    begun = [_begun(slide.time_ns, pose) for slide, pose in zip(chosen, seen, strict=True)]
    return tracks(
        [_seconds(own) for own in knots],
        [slide_tracks.gravity_at(own - delay_ns) for own in knots],
        turns=[slide_tracks.turns_at(own[:-1] - delay_ns) for own in knots],
        border_m=slide_tracks.opening_radius_m,
        start=np.array([start for start, _ in begun]),
        velocity=np.array([velocity for _, velocity in begun]),
        rest_s=np.array([slide.rest_s for slide in chosen]),
        slid_s=np.array([max(int(slide.time_ns[BEGIN]) - slide.slip_ns, 0) * NANO for slide in chosen]),
        run=facts.number[run],
        mass_kg=facts.mass_kg[run],
        area_m2=facts.area_m2[run],
        mount_rad=facts.mount_rad[run],
        temperature_c=facts.temperature_c[run],
        relative_humidity=facts.relative_humidity[run],
    )


def _begun(time_ns: Times, pose: Array) -> tuple[Array, Array]:
    """Gives the pose (3,) and velocity (3,) at frame BEGIN, from a parabola through the frames of the first window."""
    elapsed = (time_ns[:FRAMES] - time_ns[BEGIN]) * NANO
    fit = np.polynomial.polynomial.polyfit(elapsed, pose[:FRAMES], 2)
    return fit[0], fit[1]


def _knots(time_ns: Times) -> Times:
    length = int(time_ns[-1] - time_ns[0])
    return time_ns[0] + np.linspace(0, length, max(2, round(length / KNOT_NS) + 1)).astype(np.int64)


def _seconds(time_ns: Times) -> Array:
    return (time_ns - time_ns[0]) * NANO


def _padded(times: Sequence[Array]) -> Array:
    """Returns times (n, k) of rows of unequal length, the last of each repeated."""
    most = max(len(own) for own in times)
    return np.stack([np.pad(own, (0, most - len(own)), mode="edge") for own in times])
