"""A plan in words: what it changes, and what a person does by hand, with the loads that a session had."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from station.diagnosis.next_experiment.changes import MASS, MASSES, Change, Changes
from station.diagnosis.next_experiment.redone import Draw

VARIED = 1.01
"""Loads that differ by less are one: scales are read to a per cent."""


def in_words(changes: Changes, recorded: Draw | None, *, dwells: bool) -> str:
    """Returns the changes in words; what is not changed of what was recorded (runs,) is done again in random order.

    With `dwells` each run's dwell is drawn anew from the recorded range.
    """
    if changes:
        return ", ".join(_named(change, recorded) for change in changes)
    again = f"the same loads ({_range(recorded)}) again" if _varied(recorded) else "the same again"
    return f"{again}, in random order" + (", each run's dwell drawn anew" if dwells else "")


def by_hand(changes: Changes, recorded: Draw | None) -> list[str]:
    """Returns what a person has to do before some runs of the plan."""
    if not changes and _varied(recorded):
        return [f"change the block's mass as before ({_range(recorded)}), in random order, and name it in the rig file"]
    return [one.by_hand for one in changes if one.by_hand]


def _named(change: Change, recorded: Draw | None) -> str:
    """Returns the change's name; of loads which ones, and which were recorded."""
    if change.factor != MASS or recorded is None:
        return change.name
    usual = float(np.median(recorded["mass_kg"]))
    so_far = f" (so far {_range(recorded)})" if _varied(recorded) else ""
    return f"loads of {_listed([usual * factor for factor in MASSES])}{so_far} in random order"


def _varied(recorded: Draw | None) -> bool:
    return recorded is not None and float(np.ptp(np.log(np.maximum(recorded["mass_kg"], 1e-9)))) > np.log(VARIED)


def _range(recorded: Draw | None) -> str:
    loads = np.zeros(1) if recorded is None else recorded["mass_kg"]
    return f"{1e3 * loads.min():.3g} to {1e3 * loads.max():.3g} g"


def _listed(masses_kg: Sequence[float]) -> str:
    *first, last = (f"{1e3 * mass:.3g}" for mass in masses_kg)
    return f"{', '.join(first)} and {last} g"
