"""Lines that say how far simulated onsets are from recorded ones."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from shared.messages import Sample

Pair = tuple[Sample, Sample]

_LISTED = 20


def difference(recorded: Sequence[Sample], simulated: Sequence[Sample]) -> list[str]:
    """Returns the onsets run by run if there are few runs, else the farthest ones; then their sum."""
    both = [pair for pair in _pairs(recorded, simulated) if _slid(pair)]
    lines = ["run   recorded  simulated  simulated − recorded (onset, degrees)"] if both else []
    ranked = sorted(both, key=lambda pair: -abs(_apart_deg(*pair)))[:_LISTED]
    lines += [_line(was, now) for was, now in sorted(ranked, key=lambda pair: pair[0].run)]
    if len(both) > _LISTED:
        lines.append(f"(the {_LISTED} farthest apart of {len(both)} runs)")
    return [*lines, *in_sum(recorded, simulated)]


def of_scatter(share: float, *, drawn: bool) -> list[str]:
    """Returns a sentence on what a scatter of friction, relative to its mean, does to a comparison of runs.

    A run was tilted until it slid, so that a simulation of it with more friction than it had ends before its onset.
    Where there is none although a seed draws, that is said; of a share that is not known (nan), nothing.
    """
    if not share > 0.0:
        none = "The model has no scatter: its friction is the same in every run, whatever the seed"
        return [none] if drawn and share == 0.0 else []
    has = "draws another for each run" if drawn else "has its mean"
    return [
        f"Friction scatters by {100 * share:.2g} % from run to run and the simulation {has}: tilted no further than "
        "recorded, a run that had less friction than in the simulation may not slide there, and one that had more "
        "slides there earlier"
    ]


def in_sum(recorded: Sequence[Sample], simulated: Sequence[Sample]) -> list[str]:
    """Returns the mean difference over all runs, and how many of them slid on one side only."""
    pairs = _pairs(recorded, simulated)
    apart = np.array([_apart_deg(*pair) for pair in pairs if _slid(pair)])
    lines: list[str] = []
    if len(apart):
        rms = math.sqrt(float(np.mean(apart**2)))
        lines.append(f"Onsets of {len(apart)} runs: mean difference {apart.mean():+.3f}°, root mean square {rms:.3f}°")
    held = sum(now.censored and not was.censored for was, now in pairs)
    slipped = sum(was.censored and not now.censored for was, now in pairs)
    if held or slipped:
        unseen = "; their differences are not in that mean, which is biased by it" if lines else ""
        lines.append(f"{held} runs slid in the recording only, {slipped} in the simulation only{unseen}")
    return lines or ["No run has an onset to compare"]


def _pairs(recorded: Sequence[Sample], simulated: Sequence[Sample]) -> list[Pair]:
    again = {sample.run: sample for sample in simulated}
    return [(sample, again[sample.run]) for sample in recorded if sample.run in again]


def _slid(pair: Pair) -> bool:
    return not any(sample.censored for sample in pair)


def _apart_deg(was: Sample, now: Sample) -> float:
    return math.degrees(now.onset_angle_rad - was.onset_angle_rad)


def _line(was: Sample, now: Sample) -> str:
    first, second = math.degrees(was.onset_angle_rad), math.degrees(now.onset_angle_rad)
    return f"{was.run:3d} {first:10.3f} {second:10.3f} {_apart_deg(was, now):+10.3f}"
