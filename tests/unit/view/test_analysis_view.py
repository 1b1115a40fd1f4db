"""An analysis in Rerun: what is in the file is what was measured, and the viewer shows it without a complaint."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rerun.chunk import RrdReader

from shared.errors import UserError
from shared.messages import Sample
from station.friction.bins import by_direction, heat_map
from station.friction.pairs import Session, pairs_of
from station.friction.report_table import ReportTable
from station.friction.results import PairResult, analyse
from station.view import viewer
from station.view.analysis.rrd import roots_of, write_analysis
from tests.unit.friction.sessions import GEOMETRY, sample, session
from tests.unit.view.rrd_file import has_blueprint, rerun

ROOT = "/pairs/cube_on_wood"


def result_of(samples: list[Sample]) -> PairResult:
    pairs = pairs_of([Session(samples, GEOMETRY, "made up")])
    return analyse(pairs, rng=np.random.default_rng(1))[0]


def columns(path: Path) -> dict[tuple[str, str], list[Any]]:
    """Every component of every entity: its rows, without those of other chunks that lack it."""
    found: dict[tuple[str, str], list[Any]] = {}
    for chunk in RrdReader(str(path)).stream():
        for name, rows in chunk.to_record_batch().to_pydict().items():
            found.setdefault((str(chunk.entity_path), name), []).extend(rows)
    return found


@pytest.fixture(scope="module")
def full() -> PairResult:
    return result_of(session(120, rng=np.random.default_rng(2), aspect=0.8))


@pytest.fixture(scope="module")
def written(full: PairResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("rerun") / "deep" / "figures.rrd"
    table = ReportTable(title="Beside the paper", columns=("a", "b"), rows=(("x", "1 | 2"),))
    write_analysis([full], path, first=[table])
    return path


def test_the_bands_are_the_bins_means_and_variances(full: PairResult, written: Path) -> None:
    found, kept = columns(written), full.pair.kept
    bins = by_direction(kept.paper_rad, np.degrees(kept.theta_rad))
    values = np.array(found[f"{ROOT}/fig7/mean", "Measurements:values"]).ravel()
    np.testing.assert_allclose(values[1:-1], bins.mean)
    assert np.isnan(values[[0, -1]]).all()
    variances = np.array(found[f"{ROOT}/fig7/mean", "Measurements:variances"]).ravel()[1:-1]
    np.testing.assert_allclose(variances, np.nan_to_num(bins.sd) ** 2)
    degrees = np.array(found[f"{ROOT}/fig7/mean", "direction_deg"])
    np.testing.assert_allclose(degrees[1:-1], np.degrees(bins.middle_rad), atol=0.5)
    assert (degrees[0], degrees[-1]) == (0, 180)
    bars = found[f"{ROOT}/fig7/samples", "BarChart:values"][0][0]
    assert bars["buffer"] == bins.count.tolist()


def test_the_heat_map_is_a_tensor_of_patches_with_nought_where_there_is_no_sample(
    full: PairResult, written: Path
) -> None:
    kept = full.pair.kept
    tensor = columns(written)[f"{ROOT}/fig8/patches", "Tensor:data"][0][0]
    expected = heat_map(kept.pre_px.mean(axis=1), np.degrees(kept.theta_rad), size_px=(600, 600))
    np.testing.assert_allclose(np.reshape(tensor["buffer"], tensor["shape"]), np.nan_to_num(expected), rtol=1e-6)


@pytest.mark.parametrize("span", ["folded", "whole"])
def test_every_kept_slide_is_a_dot_of_its_direction_with_its_run_beside_it(
    span: str, full: PairResult, written: Path
) -> None:
    found, kept = columns(written), full.pair.kept
    direction = kept.paper_rad if span == "folded" else kept.object_rad
    count = 0
    for number in range(4):
        place = f"{ROOT}/fig9/{span}/tilted_about_{number * 90}_deg"
        x, y = np.array(found[place, "Points2D:positions"][0]).T
        chosen = kept.sector == number
        np.testing.assert_allclose(np.hypot(x, y), np.degrees(kept.theta_rad[chosen]), rtol=1e-5)
        np.testing.assert_allclose(np.cos(np.arctan2(-y, x) - direction[chosen]), 1, atol=1e-9)
        labels = found[place, "Points2D:labels"][0]
        assert [label.split(":")[0] for label in labels] == [f"run {run}" for run in kept.run[chosen]]
        count += len(x)
    assert count == len(kept)


def test_words_and_tables_are_there_and_nothing_in_them_is_markup(full: PairResult, written: Path) -> None:
    found = columns(written)
    assert "Angle of repose" in found[f"{ROOT}/conclusions", "TextDocument:text"][0][0]
    tables = found["/tables", "TextDocument:text"][0][0]
    assert tables.startswith("## Beside the paper\n")
    assert r"| x | 1 \| 2 |" in tables
    assert "Table III" in tables
    assert has_blueprint(written)
    rerun("rrd", "verify", written)


@pytest.mark.parametrize(
    "samples",
    [
        [sample()],
        [sample(run=run, slide_m=0.0005) for run in range(30)],
        [replace(sample(run=run), censored=True) for run in range(30)],
        [Sample(run=run, onset_angle_rad=0.3) for run in range(30)],
    ],
    ids=["one", "filtered", "censored", "bare"],
)
def test_a_pair_with_nothing_to_show_is_written_all_the_same(samples: list[Sample], tmp_path: Path) -> None:
    result = result_of(samples)
    write_analysis([result], tmp_path / "a.rrd")
    found = columns(tmp_path / "a.rrd")
    assert found["/tables", "TextDocument:text"]
    dots = [entity for entity, name in found if "tilted" in entity and name == "Points2D:positions"]
    assert len(dots) == 2 * bool(np.isfinite(result.pair.kept.paper_rad).any())


def test_pairs_whose_names_are_alike_but_for_signs_stand_apart() -> None:
    pairs = pairs_of([Session([replace(sample(), object=name) for name in ("a b", "a-b", "é")], GEOMETRY)])
    assert len(set(roots_of(pairs))) == 3


def test_a_place_that_cannot_be_written_to_is_said(full: PairResult, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="Expected to write the Rerun view"):
        write_analysis([full], tmp_path / "file" / "a.rrd")


@pytest.mark.skipif(not viewer.can_draw_headless(), reason="no Vulkan driver: apt-get install mesa-vulkan-drivers")
def test_no_view_complains_and_every_figure_has_one(full: PairResult, tmp_path: Path) -> None:
    path = tmp_path / "two.rrd"
    other = result_of([replace(one, plate="steel") for one in session(40, rng=np.random.default_rng(3))])
    write_analysis([full, other], path)
    with viewer.headless(size=(1200, 800)) as client:
        state = viewer.show(client, path)
    assert [view.name for view in state.views if view.reports] == []
    kinds = [view.view_class for view in state.views]
    # A page for each pair and one for each figure with both; conclusions of both, and the tables.
    assert {kind: kinds.count(kind) for kind in set(kinds)} == {
        "TimeSeries": 4,
        "BarChart": 4,
        "Tensor": 4,
        "2D": 8,
        "TextDocument": 3,
    }
