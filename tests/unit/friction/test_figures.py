"""Every figure is drawn for every kind of pair, also for those that have nothing to show."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from shared.messages import Sample
from station.friction.drawing import render
from station.friction.figures import FigureKind, figure_kinds, filters, limit_curve
from station.friction.pairs import Session, pairs_of
from station.friction.report import caption_of
from station.pages.caption import made_by
from station.pages.drawing import style
from tests.legible import illegible
from tests.unit.friction.sessions import GEOMETRY, sample, session

TABLES: dict[str, Callable[[], list[Sample]]] = {
    "full": lambda: session(60, rng=np.random.default_rng(1)),
    "one": lambda: [sample()],
    "filtered": lambda: [sample(run=run, slide_m=0.0005) for run in range(30)],
    "censored": lambda: [replace(sample(run=run), censored=True) for run in range(30)],
    "bare": lambda: [Sample(run=run, onset_angle_rad=0.3 + 0.001 * run) for run in range(30)],
}
GEOMETRIES = {"full": GEOMETRY, "one": None, "filtered": GEOMETRY, "censored": GEOMETRY, "bare": None}


@pytest.mark.parametrize("table", TABLES)
@pytest.mark.parametrize("kind", figure_kinds(), ids=lambda kind: kind.name)
def test_every_figure_is_drawn_of_every_table(kind: FigureKind, table: str, tmp_path: Path):
    (pair,) = pairs_of([Session(TABLES[table](), GEOMETRIES[table])])
    with made_by("station analyze a.mcap"):
        picture = render(kind.draw, pair, folder=tmp_path, stem="figure", caption=caption_of(kind, pair))
    image = cv2.imdecode(np.frombuffer(picture, dtype=np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    assert image.shape[1] >= 600
    assert (image < 128).any()
    assert (tmp_path / "figure.png").read_bytes() == picture
    assert (tmp_path / "figure.pdf").read_bytes().startswith(b"%PDF")
    assert "<svg" in (tmp_path / "figure.svg").read_text(encoding="utf-8")


@pytest.mark.parametrize("table", TABLES)
@pytest.mark.parametrize("kind", figure_kinds(), ids=lambda kind: kind.name)
def test_no_text_is_cut_or_lies_over_another(kind: FigureKind, table: str):
    (pair,) = pairs_of([Session(TABLES[table](), GEOMETRIES[table])])
    with style():
        assert illegible(kind.draw(pair)) == []


@pytest.mark.parametrize("spread_px", [0.02, 0.28, 3.0, 40.0])
@pytest.mark.parametrize("usual_px", [186.2, 1860.0])
def test_the_numbers_of_circumferences_stand_apart(usual_px: float, spread_px: float):
    """The rig's lay within a quarter of a pixel: six numbers with two decimals had no room."""
    (pair,) = pairs_of([Session(TABLES["full"](), GEOMETRY)])
    slides = pair.slides
    wanted_px = usual_px + spread_px * np.random.default_rng(1).uniform(-0.5, 0.5, (60, 2))
    pre, post = (wanted_px / slides.circumference_px).T[..., None, None] * np.stack([slides.pre_px, slides.post_px])
    with style():
        assert illegible(filters.draw(replace(pair, slides=replace(slides, pre_px=pre, post_px=post)))) == []


def test_the_papers_figures_are_there():
    assert [kind.number for kind in figure_kinds()][:4] == [6.0, 7.0, 8.0, 9.0]


def test_a_run_that_the_foam_held_does_not_shrink_the_limit_curve_to_a_point():
    held = [replace(sample(run=61, angle_rad=1.1), censored=True), sample(run=62, angle_rad=0.95)]
    (pair,) = pairs_of([Session([*session(60, rng=np.random.default_rng(1)), *held], GEOMETRY)])
    figure = limit_curve.draw(pair)
    assert [axes.get_rmax() < 2 * 0.36 for axes in figure.axes] == [True, True]  # pyright: ignore[reportAttributeAccessIssue] # polar
    drawn = np.concatenate([line.get_ydata() for axes in figure.axes for line in axes.lines])
    assert np.nanmax(drawn) <= figure.axes[1].get_rmax() + 1e-9  # pyright: ignore[reportAttributeAccessIssue] # polar
    labels = {text for axes in figure.axes for text in axes.get_legend_handles_labels()[1]}
    assert {
        "censored (n = 1)",
        "slide (n = 61)",
        "onset (n = 61)",
        "mean of bin",
        "limit curve",
        "90 % interval",
    } <= labels


@pytest.mark.parametrize("kind", figure_kinds(), ids=lambda kind: kind.name)
def test_people_read_degrees(kind: FigureKind) -> None:
    """Radians stand only beside degrees, where the paper's own scale is compared."""
    (pair,) = pairs_of([Session(TABLES["full"](), GEOMETRY)])
    words = [text for axes in kind.draw(pair).axes for text in (axes.get_xlabel(), axes.get_ylabel())]
    assert [word for word in (*words, kind.caption) if "(rad)" in word] == []


def test_angles_and_lengths_are_drawn_in_the_units_that_their_axes_name() -> None:
    (pair,) = pairs_of([Session(TABLES["full"](), GEOMETRY)])
    drawn = {kind.name: kind.draw(pair) for kind in figure_kinds()}
    theta_deg = np.degrees(pair.kept.theta_rad)
    assert drawn["polar"].axes[1].get_rmax() == pytest.approx(1.05 * theta_deg.max())  # pyright: ignore[reportAttributeAccessIssue] # polar
    mean = np.asarray(drawn["by_direction"].axes[0].lines[-1].get_ydata())
    assert mean == pytest.approx(theta_deg.mean())
    distance, angle = drawn["filters"].axes[:2]
    assert angle.get_xlim()[0] < theta_deg.mean() < angle.get_xlim()[1]
    (above,) = distance.child_axes
    assert above.get_xlabel() == "mm"
    drawn["filters"].draw_without_rendering()
    slid_mm = 1e3 * np.linalg.norm((pair.kept.post_m - pair.kept.pre_m).mean(axis=1), axis=1)
    mm_per_px = above.get_xlim()[1] / distance.get_xlim()[1]
    assert mm_per_px == pytest.approx(float(np.median(slid_mm / pair.kept.distance_px)), rel=0.02)
