"""Doctor tells of a block that lies where it cannot slip, and not of runs that are held now and then."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from shared.messages import Sample
from station.recording.checkup.held import held_in_a_row
from station.recording.checkup.report import examine
from station.recording.checkup.rules import findings
from station.recording.reader import open_recording
from station.recording.writer import Recording
from tests.unit.recording import session


def samples(held: Sequence[bool], *, top_deg: float = 33.0) -> list[Sample]:
    """A run for each, of four directions by turns; the first one was tilted to 60 degrees."""
    tops = [60.0, *[top_deg] * (len(held) - 1)]
    return [
        Sample(run=run, direction=run % 4, censored=one, step_to_rad=math.radians(top))
        for run, (one, top) in enumerate(zip(held, tops, strict=True), start=1)
    ]


def by_turns(runs: int, every: int) -> list[bool]:
    return [run % every == 0 for run in range(1, runs + 1)]


def test_a_block_that_lies_still_is_told_of(tmp_path: Path) -> None:
    """The planted session ends as the long soak did: each direction is narrowed to 33 degrees, and nothing slips."""
    path = tmp_path / "still.mcap"
    with Recording(path, provenance=session.provenance()) as recording:
        for sample in samples([*by_turns(100, 20), *[True] * 40]):
            recording.write_message("session/sample", sample, receive_ns=session.START_NS + sample.run * 10**9)
    told = [finding.sentence for finding in findings(examine(open_recording(path))) if finding.rule == "held"]
    assert len(told) == 1
    assert "runs 100 to 140 (41 in a row)" in told[0]
    assert "up to 33.0° to 33.0°" in told[0]
    assert "others were tilted to 60.0°" in told[0]


def test_runs_that_are_held_now_and_then_are_not() -> None:
    """A good session of 2500 runs (seed 20261701, 123 held) had three in a row; from five on it is suspected."""
    for row, suspected in ((3, 0), (4, 0), (5, 1)):
        assert len(held_in_a_row(samples([*by_turns(2490, 25), False, *[True] * row]))) == suspected


def test_what_a_session_suspects_is_as_rare_as_it_says() -> None:
    """Sessions whose runs are held each on its own are suspected hardly once in a thousand."""
    rng, suspected = np.random.default_rng(1), 0
    for _ in range(2000):
        share = rng.uniform(0.0, 0.6)
        suspected += bool(held_in_a_row(samples((rng.random(60) < share).tolist())))
    assert suspected <= 8  # 2 at most are expected; more than 8 come by chance once in 10 000


def test_disturbed_and_tipped_runs_tell_nothing() -> None:
    """A cut link, or a block that tips over, is no block that is held."""
    row = samples([*by_turns(100, 20), *[True] * 40])
    for flag in ("disturbed_cut", "tipped"):
        flagged = [
            Sample(run=one.run, direction=one.direction, censored=one.censored, flags=(flag,) if one.run > 99 else ())
            for one in row
        ]
        assert held_in_a_row(flagged) == ()
