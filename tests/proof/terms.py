"""The tool's evidence as plain tables: what rivals that know no physics are given."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from station.diagnosis.observations.channel import Channel
from station.diagnosis.observations.covariates import ANGLES
from station.diagnosis.observations.plate import Times
from station.physics.contact import Array, Bools
from tests.proof.rivals import Table

CHANNELS = ("onset", "along", "across", "turn", "rest", "plate")
"""Onsets, slides along, across and turning, and what block and plate seem to move before a slide.

The strain of the mark's picture is left out: it has three components that no function of a covariate is common to.
"""

LEFT_OUT = ("slide", "tilt")
"""The tilt at which a block slid is the friction that the run drew: as a covariate of its slide it would explain the
draw by itself, and worsen what is held out."""

_STANDARD_SPEED_M_S = 0.02


@dataclass(frozen=True, eq=False, kw_only=True)
class Terms:
    """One table: functions of covariates (n, k), standardised; their names and covariates; the residuals (n,).

    Where friction is meant, residuals are relative friction; see the channels of the evidence for the units of others.
    `known` (n,) is False for runs without a slide; `run` (n,) is the run's place in the evidence.
    """

    channel: str
    phase: str
    names: tuple[str, ...]
    covariates: tuple[str, ...]
    columns: Array
    residual: Array
    known: Bools
    run: Times


def tables_of(table: Table) -> list[Terms]:
    """All channels that a table can hold, with the residuals of the plain model."""
    found = [table.evidence.channel(name) for name in CHANNELS]
    return [_terms(channel, channel.residual(table.plain.model)) for channel in found if channel is not None]


def _terms(channel: Channel, residual: Array) -> Terms:
    rows = channel.rows
    listed: list[tuple[str, str, Array]] = []
    for name, values in rows.covariates.items():
        known = np.isfinite(values)
        if (channel.phase, name) == LEFT_OUT or known.sum() < 0.5 * len(values):
            continue
        filled = np.where(known, values, np.median(values[known]))
        listed += [(term, name, column) for term, column in _functions(name, filled)]
    kept = [one for one in listed if np.std(one[2]) > 1e-9]
    columns = [(column - column.mean()) / column.std() for _, _, column in kept]
    return Terms(
        channel=channel.name,
        phase=channel.phase,
        names=tuple(term for term, _, _ in kept),
        covariates=tuple(name for _, name, _ in kept),
        columns=np.column_stack(columns) if columns else np.zeros((len(rows), 0)),
        residual=residual,
        known=~rows.limit,
        run=rows.run,
    )


def _functions(name: str, values: Array) -> list[tuple[str, Array]]:
    """Two harmonics of an angle; of the speed the laws of friction; else the value and its square."""
    if name in ANGLES:
        return [(f"{name}:{k}", wave(k * values)) for k in (1, 2) for wave in (np.cos, np.sin)]
    if name == "speed":
        return [
            ("speed", values),
            ("speed:log", np.log(np.maximum(values, 1e-4))),
            ("speed:exp", np.exp(-values / _STANDARD_SPEED_M_S)),
        ]
    return [(name, values), (f"{name}:square", (values - values.mean()) ** 2)]
