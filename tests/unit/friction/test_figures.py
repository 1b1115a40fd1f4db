"""Every figure is drawn for every kind of pair, also for those that have nothing to show."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from shared.messages import Sample
from station.friction.drawing import render
from station.friction.figures import FigureKind, figure_kinds
from station.friction.pairs import Session, pairs_of
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
    picture = render(kind.draw, pair, folder=tmp_path, stem="figure")
    image = cv2.imdecode(np.frombuffer(picture, dtype=np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    assert image.shape[1] >= 600
    assert (image < 128).any()
    assert (tmp_path / "figure.png").read_bytes() == picture
    assert (tmp_path / "figure.pdf").read_bytes().startswith(b"%PDF")


def test_the_papers_figures_are_there():
    assert [kind.number for kind in figure_kinds()][:4] == [6.0, 7.0, 8.0, 9.0]
