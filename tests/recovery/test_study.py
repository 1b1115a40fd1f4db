"""`station study`: its sessions, that it goes on where it was broken off, and that its comparison can disagree."""

from __future__ import annotations

import json
import os
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from shared.messages import Sample
from station.__main__ import main
from station.app import analysis_files, assembly
from station.app.study import paper
from station.app.study.beside import tables_of
from station.app.study.compare import Row, pace_row, rows_of, verdicts_of
from station.app.study.design import parts_of
from station.app.study.essentials import LEFT_OUT
from station.app.study.rigs import rig_of, rig_text
from station.friction.pairs import Session, pairs_of
from station.friction.results import PairResult, analyse
from station.recording.reader import digest, open_recording
from tests.unit.friction.sessions import GEOMETRY, session

SAMPLES = 20
"""Five for each pair."""


def study(out: Path, *, samples: int = SAMPLES, seed: int = 3) -> int:
    return main(["study", "--out", str(out), "--samples", str(samples), "--seed", str(seed), "--jobs", "2"])


def digests(out: Path) -> dict[str, str]:
    return {path.name: digest(open_recording(path)) for path in sorted((out / "recordings").glob("*.mcap"))}


def test_a_small_study_measures_what_is_planted_and_goes_on_where_it_was_broken_off(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(analysis_files, "figure_kinds", tuple)  # figures are looked at elsewhere, and take seconds
    out = tmp_path / "study"
    assert study(out) == 0
    first, written = digests(out), json.loads((out / "study.json").read_text(encoding="utf-8"))
    assert len(first) == len(paper.PAIRS)
    assert not (out / "recordings" / "unfinished").exists()
    assert "The study beside the paper" in (out / "report.html").read_text(encoding="utf-8")
    means = {row["pair"]: row for row in written["rows"] if row["quantity"].startswith("mean")}
    for pair in paper.PAIRS:
        planted_sd = pair.mean_rad * pair.scatter
        # Half as wide again as for plain scatter: an ellipse's mean depends on where the block happened to slide.
        assert abs(means[pair.name]["simulated"] - pair.mean_rad) < 4.5 * planted_sd / np.sqrt(SAMPLES / 4), pair.name
    assert means["steel on steel"]["simulated"] > 1.4 * means["steel on wood"]["simulated"]

    one = out / "recordings" / "wood_on_wood_01.mcap"
    parts = {part.path.name: part for part in parts_of(SAMPLES, seed=3, folder=one.parent)}
    assert not LEFT_OUT & set(open_recording(one).topics)
    assert main(["doctor", str(one)]) == 0
    assert main(["check", str(one)]) == 0, "a replay takes other decisions"

    turned = open_recording(one).samples()[0].start_yaw_rad - parts[one.name].yaw_rad
    assert abs((turned + np.pi) % (2 * np.pi) - np.pi) < 0.01

    kept, lost = (out / "recordings" / f"{name}_01.mcap" for name in ("wood_on_steel", "steel_on_wood"))
    stamp = kept.stat().st_mtime_ns
    half = lost.parent / "unfinished" / f"{lost.name}.partial"
    half.parent.mkdir()
    half.write_bytes(lost.read_bytes()[: lost.stat().st_size // 2])  # as kill -9 leaves it
    os.unlink(lost)
    assert study(out) == 0
    assert digests(out) == first
    assert kept.stat().st_mtime_ns == stamp
    again = json.loads((out / "study.json").read_text(encoding="utf-8"))
    assert again["about"]["sessions_simulated_now"] == 1
    assert (again["rows"], again["anisotropy"]) == (written["rows"], written["anisotropy"])

    capsys.readouterr()
    assert study(out, seed=4) == 2
    assert "another seed, plan or rig" in " ".join(capsys.readouterr().err.split())


def test_the_parts_are_all_the_samples_with_seeds_of_their_own(tmp_path: Path) -> None:
    parts = parts_of(paper.SAMPLES, seed=1, folder=tmp_path)
    assert sum(part.samples for part in parts) == paper.SAMPLES
    by_pair = [sum(part.samples for part in parts if part.pair is pair) for pair in paper.PAIRS]
    assert max(by_pair) - min(by_pair) <= 1
    assert len({part.seed for part in parts}) == len({part.path for part in parts}) == len(parts)
    assert not {part.seed for part in parts} & {part.seed for part in parts_of(paper.SAMPLES, seed=2, folder=tmp_path)}


def test_the_sessions_of_a_pair_part_a_quarter_turn_of_the_block_evenly(tmp_path: Path) -> None:
    parts = parts_of(paper.SAMPLES, seed=1, folder=tmp_path)
    firsts = set[float]()
    for pair in paper.PAIRS:
        yaws = sorted(part.yaw_rad for part in parts if part.pair is pair)
        assert len(yaws) == 4
        np.testing.assert_allclose(np.diff(yaws), np.pi / 8)
        assert 0 <= yaws[0] < np.pi / 2
        firsts.add(yaws[0])
    assert len(firsts) == 4


def test_the_papers_own_numbers_add_up() -> None:
    assert sum(pair.unique for pair in paper.PAIRS) == paper.FILTERED
    assert [sum(pair.by_filter.values()) for pair in paper.PAIRS] == [181, 55, 233, 143]


def test_a_pairs_rig_differs_from_the_simulated_one_in_block_plate_and_friction_only() -> None:
    text = assembly.simulated_rig_path().read_text(encoding="utf-8")
    wood_on_steel = next(pair for pair in paper.PAIRS if pair.preset == "wood_on_steel")
    expected: dict[str, Any] = tomllib.loads(text)
    expected["block"] |= {"name": "wood", "material": "wood", "mass_kg": 0.0005}
    expected["twin"]["pair"] = "wood_on_steel"
    assert tomllib.loads(rig_text(text, wood_on_steel)) == expected
    assert rig_of(wood_on_steel).block.mass_kg == 0.0005


def results(*, wood_ratio: float, steel_mean: float) -> tuple[PairResult, ...]:
    """Made-up samples of two pairs: steel on steel with a mean mu, wood on wood with an ellipse."""

    def named(samples: list[Sample], name: str) -> list[Sample]:
        return [replace(one, object=name, plate=name) for one in samples]

    rng = np.random.default_rng(5)
    swing = np.log(wood_ratio) / 2
    steel = named(session(300, rng=rng, mu=lambda _: float(np.tan(steel_mean))), "steel")
    wood = named(session(300, rng=rng, mu=lambda phi: float(0.41 * np.exp(swing * np.cos(2 * phi)))), "wood")
    pairs = pairs_of([Session([*steel, *wood], GEOMETRY, "made up")])
    return analyse(pairs, rng=rng)


def row(rows: tuple[Row, ...], quantity: str, pair: str) -> Row:
    return next(one for one in rows if one.quantity.startswith(quantity) and one.pair == pair)


def test_the_comparison_says_no_to_another_mean_and_to_missing_anisotropy() -> None:
    same = results(wood_ratio=1.3, steel_mean=0.35)
    assert row(rows_of(same), "mean", "steel on steel").agrees
    assert [(one.pair, one.found, one.agrees) for one in verdicts_of(same)] == [
        ("steel on steel", False, True),
        ("wood on wood", True, True),
    ]
    other = results(wood_ratio=1.0, steel_mean=0.40)
    mean = row(rows_of(other), "mean", "steel on steel")
    assert not mean.agrees
    assert mean.in_standard_errors > 10
    assert [one.agrees for one in verdicts_of(other)] == [True, False]


def test_a_share_is_compared_with_the_scatter_of_both_studies() -> None:
    nothing = row(rows_of(results(wood_ratio=1.0, steel_mean=0.35)), "filtered", "all")
    assert nothing.paper == pytest.approx(0.0872, abs=1e-4)
    share = (552 + round(nothing.simulated * 600)) / 6930
    assert nothing.standard_error == pytest.approx(np.sqrt(share * (1 - share) * (1 / 6330 + 1 / 600)))


def test_the_pace_is_the_mean_over_all_samples_of_their_own_sessions() -> None:
    quick = [replace(one, start_ns=one.run * 10_000_000_000) for one in session(3, rng=np.random.default_rng(1))]
    slow = [replace(one, start_ns=one.run * 26_000_000_000) for one in session(9, rng=np.random.default_rng(2))]
    pace = pace_row([Session(quick), Session(slow), Session(slow[:1])])
    assert pace.simulated == pytest.approx((3 * 10 + 9 * 26) / 12)
    assert pace.agrees
    assert not pace_row([Session(quick)]).agrees


def test_only_rows_that_differ_are_given_a_reason_and_table_iii_stands_beside_the_papers() -> None:
    found = results(wood_ratio=1.3, steel_mean=0.35)
    rows = rows_of(found)
    beside, _, filters = tables_of(rows, verdicts_of(found), found)
    assert not row(rows, "flagged by distance", "all").agrees
    assert "Why flagged by distance, all differs, we believe" in beside.note
    assert row(rows, "mean", "steel on steel").agrees
    assert "Why mean" not in beside.note
    (steel, wood) = filters.rows
    counts = found[0].counts
    assert steel[:3] == ("steel on steel", "300", f"138 : {counts.unique}")
    assert wood[3] == f"55 : {found[1].counts.total}"
