"""Evidence from a table: onsets on a tilted plate, and friction that was measured by pulling, at rest or sliding."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from shared.messages import Sample
from station.diagnosis.observations.build import facts_of
from station.diagnosis.observations.channel import ALONG, ONSET, Channel
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.moments import RunFacts
from station.diagnosis.observations.pulled import SETTLING
from station.diagnosis.observations.series import in_windows, settling, stretches_of, travelled_of
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.starts import FREE_M
from station.diagnosis.observations.table_onsets import onsets_of
from station.diagnosis.observations.table_pulled import pulled_of
from station.diagnosis.observations.table_rows import TableRows, mass_of
from station.diagnosis.observations.table_size import require_room
from station.diagnosis.observations.table_states import moments_ns, places_m, rests_s
from station.signals.measured import Measured, left_alone


def table_evidence(recorded: Measured | Sequence[Sample], setting: Setting) -> Evidence:
    """Returns the evidence of a table's rows; what a row lacks has the columns' defaults.

    Raises:
        UserError: if the rows of its groups are too many for a diagnosis.
    """
    table = recorded if isinstance(recorded, Measured) else Measured.of(recorded)
    rows = in_windows(TableRows.of(table))
    notes = list(_notes(table, rows))
    rows, leaned = _free(rows, setting)
    rows = rows if travelled_of(rows) is not None else rows.typical_first()
    if leaned:
        notes.append(f"{leaned} rows of blocks that lay against the foam were left out")
    require_room(rows.group, len(rows))
    facts = _facts(rows, setting)
    return Evidence(
        channels=tuple(_channels(rows, facts, setting)),
        run_number=rows.names.astype(np.float64),
        facts=facts,
        total_runs=len(table) - rows.copies,
        notes=tuple(notes),
        group=rows.group,
        stretch=stretches_of(rows),
    )


def _notes(table: Measured, rows: TableRows) -> Iterator[str]:
    if not len(rows):
        yield "no row of the table has an onset angle between 0.02 and pi/2 rad, or a coefficient of friction above 0"
    elif rows.lost:
        yield f"{rows.lost} rows have no usable onset angle or coefficient and were left out"
    if rows.copies:
        yield f"{rows.copies} rows repeat a row of the same run or time in all cells and were left out"
    if len(rows) and len(rows) < rows.read:
        yield f"{rows.read} rows of a continuous record were averaged in {len(rows)} windows of equal slip"
    if len(rows) and not rows.ordered:
        yield "the table has no column run or time that varies, so nothing can be said of the order of its rows"
    if table.ignored:
        yield left_alone(table.ignored)


def _free(rows: TableRows, setting: Setting) -> tuple[TableRows, int]:
    """Returns the rows without those of blocks that lay against the foam, which holds them, and the number of these."""
    free_m = np.where(np.isfinite(rows.foam_free_m), rows.foam_free_m, setting.free_m(places_m(rows)))
    leaned = ~rows.pulled & (free_m <= FREE_M)
    return rows.chosen(np.flatnonzero(~leaned)), int(leaned.sum())


def _facts(rows: TableRows, setting: Setting) -> RunFacts:
    facts = facts_of(tuple(rows.samples), setting)
    tilt = np.where(rows.pulled, 0.0, rows.of_samples("onset_angle_rad"))
    mass = np.where(np.isfinite(rows.load_n), mass_of(rows.load_n, tilt), facts.mass_kg)
    typical = float(np.median(tilt)) if len(rows) else 0.0
    rest_ns = moments_ns(rows) - np.round(rests_s(rows, typical) * 1e9).astype(np.int64)
    return replace(facts, number=rows.number, rest_ns=rest_ns, mass_kg=mass)


def _channels(rows: TableRows, facts: RunFacts, setting: Setting) -> Iterator[Channel]:
    """Yields the onsets or the friction at rest, then the friction while sliding; only what there are rows of."""
    moving = rows.pulled & (rows.speed_m_s > 0)
    if (~rows.pulled).any():
        yield onsets_of(rows, facts, setting, np.flatnonzero(~rows.pulled))
    unsettled = settling(rows)
    masks = {ONSET: rows.pulled & ~moving, ALONG: moving & ~unsettled, SETTLING: moving & unsettled}
    for name, mask in masks.items():
        if mask.any():
            yield pulled_of(name, rows, facts, mask)
