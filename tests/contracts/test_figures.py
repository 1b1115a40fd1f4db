"""Every figure of every report says what it shows, of how many, what its bars are, and the command that makes it."""

from __future__ import annotations

import argparse
import importlib
import re
import shlex
from collections.abc import Callable
from dataclasses import dataclass, field
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes

from station.angles.compare import compare
from station.angles.page import comparison_page
from station.app.analysis_files import write_results
from station.diagnosis.report.page import html_page as diagnosis_page
from station.friction.figures import figure_kinds
from station.friction.pairs import Session, pairs_of
from station.friction.results import analyse, with_limit_curves
from station.pages import figure
from station.pages.caption import Caption, command_line, made_by
from tests.legible import illegible
from tests.proof.__main__ import options_of
from tests.proof.page import html_page as proof_page
from tests.proof.pictures import draw_all
from tests.proof.report import column_of
from tests.unit.angles.test_compare import stop
from tests.unit.app.test_one_run import figure_of, sliding
from tests.unit.diagnosis.tables import grained
from tests.unit.diagnosis.test_report import with_slides
from tests.unit.friction.sessions import GEOMETRY, session
from tests.unit.proof.test_report import ABOUT, CASES, column

ROOT = Path(__file__).parents[2]
INTERVALS = ("errorbar", "fill_between", "axhspan", "axvspan")
"""The functions with which matplotlib draws bars and bands."""


@dataclass
class Report:
    """A report that was made: its page, and each file of a figure with the drawing's number and its caption."""

    html: str = ""
    files: list[tuple[Path, int, Caption]] = field(default_factory=list[tuple[Path, int, Caption]])
    barred: set[int] = field(default_factory=set[int])
    kept: list[Any] = field(default_factory=list[Any])


def analyze(folder: Path) -> str:
    rng = np.random.default_rng(1)
    pairs = pairs_of([Session(session(60, rng=rng), GEOMETRY)])
    results = with_limit_curves(analyse(pairs, rng=rng), rng=rng)
    with made_by(command_line("station", "analyze", "my session.mcap")):
        write_results(results, folder, sources=["my session.mcap"])
    return (folder / "report.html").read_text(encoding="utf-8")


def diagnose(folder: Path) -> str:
    with made_by("station diagnose a.csv --seed 1 --report page.html"), figure.kept_in(folder):
        return diagnosis_page(grained().diagnosis, with_slides(), motion=figure_of(sliding()))


def proof(folder: Path) -> str:
    with made_by(ABOUT.command):
        of_own = column("own", CASES).proof
        drawn = draw_all(CASES, folder, "own")
        assert len(drawn) == 3
    return proof_page(ABOUT, [column_of(of_own, pictures=drawn)])


def compare_angles(folder: Path) -> str:
    stops = [stop(angle, {"imu": [angle + 0.1, angle + 0.3]}, index=angle) for angle in range(4)]
    with figure.kept_in(folder):
        return comparison_page(compare(stops, readings=2), source="angles.mcap")


REPORTS: dict[str, Callable[[Path], str]] = {
    "analyze": analyze, "diagnose": diagnose, "proof": proof, "compare-angles": compare_angles,
}  # fmt: skip
LEAST = {"analyze": len(figure_kinds()), "diagnose": 7, "proof": 3, "compare-angles": 1}


@pytest.fixture(scope="module", params=REPORTS)
def report(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Report:
    made, write = Report(), figure.write

    def written(drawing: Any, path: Path, caption: Caption) -> None:
        made.kept.append(drawing)  # a number is a drawing's for as long as it lives
        made.files.append((path, id(drawing), caption))
        write(drawing, path, caption)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figure, "write", written)
        for name in INTERVALS:
            patch.setattr(Axes, name, _marked(getattr(Axes, name), made))
        made.html = REPORTS[request.param](tmp_path_factory.mktemp(request.param))
    assert len(captions(made)) >= LEAST[request.param]
    return made


def _marked(draw: Callable[..., Any], made: Report) -> Callable[..., Any]:
    def marked(axes: Axes, *arguments: Any, **named: Any) -> Any:
        made.barred.add(id(axes.get_figure()))
        return draw(axes, *arguments, **named)

    return marked


def captions(made: Report) -> list[str]:
    """The caption of each figure on the page; a figure without one is empty."""
    shown = re.findall(r"<figure>(.*?)</figure>", made.html, flags=re.DOTALL)
    found = (re.search(r"<figcaption>(.*?)</figcaption>\Z", one, flags=re.DOTALL) for one in shown)
    return [one[1] if one else "" for one in found]


def test_each_caption_has_a_sentence_a_number_and_a_command_that_exists(report: Report) -> None:
    for caption in captions(report):
        told = re.fullmatch(
            r"(?P<shows>[A-ZÀ-Þ].{20,}\.) n = [1-9]\d* [a-z].*\. Made by <code>(?P<command>.+)</code>",
            caption, flags=re.DOTALL,
        )  # fmt: skip
        assert told, caption
        understood(unescape(told["command"]))


def understood(command: str) -> None:
    """Fails for a command that its own program would refuse."""
    words = shlex.split(command)
    if words[:3] == ["python", "-m", "tests.proof"]:
        options_of(words[3:])
        return
    assert words[0] == "station", command
    parser = argparse.ArgumentParser(exit_on_error=False)
    importlib.import_module(f"station.app.commands.{words[1].replace('-', '_')}").add_arguments(parser)
    parser.parse_args(words[2:])


def test_whoever_draws_bars_or_a_band_says_what_they_are(report: Report) -> None:
    assert report.files
    for path, number, caption in report.files:
        assert bool(caption.interval) == (number in report.barred), (path.name, caption)
        assert not caption.interval or caption.interval in unescape(report.html)


def test_each_drawing_is_kept_as_svg_and_pdf_with_its_caption_inside(report: Report) -> None:
    stems = {path.with_suffix("") for path, _, _ in report.files}
    moving = report.html.count("<animateTransform") > 0
    assert len(stems) == len(captions(report)) - moving
    for path, _, caption in report.files:
        assert path.with_suffix(".pdf").exists()
        if path.suffix == ".svg":
            text = unescape(path.read_text(encoding="utf-8"))
            assert f"n = {caption.count}" in text
            assert "Made by: " in text


def test_no_text_of_a_drawing_is_cut_or_lies_over_another(report: Report) -> None:
    drawings = {
        number: (path.stem, drawing) for (path, number, _), drawing in zip(report.files, report.kept, strict=True)
    }
    found = {name: lines for name, drawing in drawings.values() if (lines := illegible(drawing))}
    assert found == {}


def test_no_report_makes_figures_of_its_own() -> None:
    folders = ("station/friction", "station/diagnosis", "station/angles", "station/app", "tests/proof")
    files = [file for folder in folders for file in (ROOT / folder).rglob("*.py")]
    own = [file for file in files if re.search(r"<fig|\.savefig\(", file.read_text(encoding="utf-8"))]
    assert own == []


def test_a_figure_outside_of_a_page_has_no_command_to_name() -> None:
    with pytest.raises(LookupError):
        _ = Caption(shows="It shows.", count="3 runs").html
