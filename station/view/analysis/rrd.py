"""Writes an analysis as a Rerun file with its layout inside: the paper's Figs. 7, 8 and 9 of every surface pair."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from shared.errors import UserError
from station.friction.pairs import Pair
from station.friction.report_table import ReportTable
from station.friction.results import PairResult
from station.view.analysis import by_direction, heat_map, polar, words

APPLICATION = "repose_analysis"
_TABLES = "tables"
_CONCLUSIONS = "conclusions"
_FLUSH_S = 60.0


def write_analysis(results: Sequence[PairResult], path: Path, *, first: Sequence[ReportTable] = ()) -> None:
    """Writes the file `path`; the tables `first` stand before the analysis's own.

    Raises:
        UserError: if the file cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.open("wb").close()
    except OSError as error:
        raise UserError(f"Expected to write the Rerun view to {path}, but that failed: {error.strerror}") from error
    recording = rr.RecordingStream(APPLICATION)
    recording.set_sinks(rr.FileSink(path))
    recording.set_log_time_enabled(False)
    recording.set_log_tick_enabled(False)
    roots = roots_of([result.pair for result in results])
    # Active, not only default: the viewer would keep the last analysis's layout, with its pairs.
    recording.send_blueprint(_layout(results, roots), make_active=True, make_default=True)
    recording.send_recording_name("analysis: " + ", ".join(result.pair.name for result in results))
    for result, root in zip(results, roots, strict=True):
        for figure in (by_direction, heat_map, polar):
            figure.draw(recording, root, result.pair)
        _say(recording, f"{root}/{_CONCLUSIONS}", words.of_pair(result))
    _say(recording, _TABLES, words.of_all(results, first=first))
    recording.flush(timeout_sec=_FLUSH_S)
    recording.disconnect()


def roots_of(pairs: Sequence[Pair]) -> list[str]:
    """Returns the entity of each pair in the recording.

    It is the pair's name in letters and digits, told apart by a number if need be.
    """
    roots: list[str] = []
    for pair in pairs:
        stem = "pairs/" + (re.sub(r"\W+", "_", pair.name).strip("_") or "pair")
        roots.append(stem if stem not in roots else f"{stem}_{len(roots)}")
    return roots


def _say(recording: rr.RecordingStream, path: str, text: str) -> None:
    recording.log(path, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)


def _layout(results: Sequence[PairResult], roots: Sequence[str]) -> rrb.Blueprint:
    """Returns a page for every pair.

    With several pairs there is one for each figure, too, as the paper prints them; then come the tables.
    """
    pairs = [(root, result.pair) for root, result in zip(roots, results, strict=True)]
    pages: list[rrb.Container | rrb.View] = [_page(root, pair) for root, pair in pairs]
    if len(pairs) > 1:
        pages = [
            _beside("Fig. 7", [by_direction.views(root, pair, title=pair.name) for root, pair in pairs]),
            _beside("Fig. 8", [heat_map.view(root, pair, title=pair.name) for root, pair in pairs]),
            _beside("Fig. 9", [polar.views(root, pair, title=pair.name) for root, pair in pairs]),
            *pages,
        ]
    pages.append(rrb.TextDocumentView(origin=_TABLES, name="Tables"))
    return rrb.Blueprint(
        rrb.Tabs(*pages, active_tab=0),
        rrb.TimePanel(timeline=by_direction.DIRECTION, state="collapsed", play_state="paused"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_layout=False,
        auto_views=False,
    )


def _page(root: str, pair: Pair) -> rrb.Container:
    figures = rrb.Vertical(
        rrb.Horizontal(by_direction.views(root, pair, title="Fig. 7"), heat_map.view(root, pair, title="Fig. 8")),
        polar.views(root, pair, title="Fig. 9"),
    )
    said = rrb.TextDocumentView(origin=f"{root}/{_CONCLUSIONS}", name="Conclusions")
    return rrb.Horizontal(figures, said, column_shares=[5, 2], name=pair.name)


def _beside(name: str, views: Sequence[rrb.Container | rrb.View]) -> rrb.Container:
    return rrb.Grid(*views, grid_columns=2 if len(views) > 2 else 1, name=name)
