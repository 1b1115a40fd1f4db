"""Each run that cannot be used has its reason, which the answer tells."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
from rich.console import Console

from station.diagnosis.observations import left_out
from station.diagnosis.observations.build import Recorded, evidence_of
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.setting import Setting
from station.diagnosis.report.headline import headline
from station.diagnosis.report.summary import summary
from station.diagnosis.result import Diagnosis
from station.diagnosis.result_json import as_json
from station.signals.flags import NO_TILT
from station.signals.session import Signals
from tests.unit.diagnosis.recorded import OPENING_RADIUS_M, session

WIDE = Setting(opening_radius_m=OPENING_RADIUS_M)


def reasons(signals: Signals, setting: Setting = WIDE) -> dict[str, int]:
    evidence: Evidence = evidence_of(signals, setting)
    assert evidence.used() + sum(evidence.left_out.values()) == evidence.total_runs
    return dict(evidence.left_out)


def test_of_a_whole_session_nothing_is_left_out() -> None:
    assert reasons(session()) == {}


def test_blocks_that_lean_on_the_foam_are_counted() -> None:
    starts = np.array([np.hypot(*track.pose[0, :2]) for track in Recorded(session(), WIDE).tracks])
    narrow = Setting(opening_radius_m=float(starts.min()))
    assert reasons(session(), narrow) == {left_out.LEANED: 24}


def test_a_block_that_leans_and_slides_clear_of_the_foam_loses_only_its_onset() -> None:
    """The figure of the onsets had 27 of 56 used runs, and nothing said why."""
    starts = np.array([np.hypot(*track.pose[0, :2]) for track in Recorded(session(), WIDE).tracks])
    evidence = evidence_of(session(), Setting(opening_radius_m=float(starts.max()) + 5e-4))
    onsets = evidence.channel("onset")
    assert onsets is not None
    assert 0 < len(onsets) < evidence.used()
    assert dict(evidence.without_onset) == {left_out.LEANED: evidence.used() - len(onsets)}
    assert not evidence_of(session(), WIDE).without_onset


def test_a_block_that_held_has_no_onset_and_counts() -> None:
    whole = session()
    held = [replace(sample, censored=True) for sample in whole.samples[:5]]
    evidence = evidence_of(replace(whole, samples=(*held, *whole.samples[5:])), WIDE)
    assert (evidence.used(), dict(evidence.without_onset)) == (24, {left_out.HELD: 5})


def test_runs_of_which_nothing_was_recorded_are_counted() -> None:
    whole = session()
    last_ns = int(whole.attitude.time_ns[-1])
    first_ns = int(whole.attitude.time_ns[0])
    half = replace(whole, attitude=whole.attitude.between(first_ns, (first_ns + last_ns) // 2))
    assert reasons(half) == {left_out.NO_EVENTS: 12}


def test_runs_that_tell_nothing_are_counted() -> None:
    whole = session()
    level, *rest = whole.samples
    level = replace(level, censored=True, flags=(NO_TILT,))
    unseen = whole.corners.between(0, 1)
    assert reasons(replace(whole, corners=unseen, samples=(level, *rest))) == {left_out.HELD: 1}


def test_the_reasons_are_told() -> None:
    found = Diagnosis(
        recording="a.mcap", total_runs=120, used_runs=75, verdict="not supported",
        left_out={left_out.HELD: 7, left_out.LEANED: 38},
    )  # fmt: skip
    told, text = "45 of 120 runs left out: 7 did not slide, 38 leaned on the foam", io.StringIO()
    Console(file=text, width=200).print(summary(found))
    assert told in text.getvalue()
    assert f"{told}." in headline(found)
    expected = [{"reason": "did not slide", "count": 7}, {"reason": "leaned on the foam", "count": 38}]
    assert as_json(found)["runs"]["left_out"] == expected
    assert "left out" not in headline(replace(found, left_out={}))
    found = replace(found, without_onset={left_out.LEANED: 8, left_out.HELD: 21})
    told = (
        "29 of the 75 used runs have no onset: 8 leaned on the foam (only their slides count), 21 did not slide (only "
    )
    told += "that they held counts)"
    Console(file=text, width=400).print(summary(found))
    assert f"38 leaned on the foam; {told}" in text.getvalue()
    assert f"{told}." in headline(replace(found, left_out={}))
    expected = [{"reason": "leaned on the foam", "count": 8}, {"reason": "did not slide", "count": 21}]
    assert as_json(found)["runs"]["without_onset"] == expected
