"""A sample that counts is called one thing wherever it is shown: kept, and one without a slip is censored."""

from __future__ import annotations

import io
from importlib.resources import files
from pathlib import Path

import numpy as np
from rich.console import Console, RenderableType

from shared.bus import Received
from shared.messages import Sample
from station.app.display.panel import rendered
from station.app.display.watched import Watched
from station.app.many import analyses, dataset
from station.app.sample_tables import directions_table
from station.friction.pairs import Session, pairs_of
from station.friction.report_tables import tables
from station.friction.results import analyse
from station.sampling.plan import Plan
from tests.unit.friction.sessions import GEOMETRY, session

SAMPLE = Sample(run=1, direction=0, onset_angle_rad=0.3)


def printed(shown: RenderableType) -> str:
    out = io.StringIO()
    Console(file=out, width=100, height=40).print(shown)
    return out.getvalue()


def panel(folder: Path) -> str:
    watch = Watched(Plan(samples=2), folder / "a.mcap")
    before = printed(rendered(watch.moment()))
    watch.take(Received("session/sample", 1, SAMPLE))
    return before + printed(rendered(watch.moment()))


def test_the_panel_the_page_and_the_summary_say_kept_samples(tmp_path: Path) -> None:
    page = (files("station.app.serve") / "pages" / "index.html").read_text(encoding="utf-8")
    for shown in (panel(tmp_path), page, printed(directions_table([SAMPLE]))):
        assert "kept samples" in shown
        assert "slips" not in shown


def test_tables_of_many_and_of_a_report_have_the_same_columns() -> None:
    many = analyses.reading().shown.columns
    assert many[:4] == ("samples", "kept", "censored", "flagged")
    assert "kept" in dataset.sampling(out=None, with_digest=False).shown.columns
    rng = np.random.default_rng(1)
    results = analyse(pairs_of([Session(session(30, rng=rng), GEOMETRY)]), rng=rng)
    filtered, *others = tables(results)
    assert (filtered.columns[1], filtered.columns[-1]) == ("slid", "censored")
    assert [table.title for table in others if "kept samples" in table.title]
    assert not [table.title for table in others if "kept slides" in table.title]
