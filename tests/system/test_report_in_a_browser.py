"""A report in a real browser: as wide as a phone, and in the dark."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from station.angles.compare import compare
from station.angles.page import comparison_page
from station.diagnosis.report.page import html_page
from station.pages.caption import Caption, made_by
from station.pages.figure import figure
from station.pages.page import whole_page
from tests.system import chromium
from tests.unit.angles.test_compare import stop
from tests.unit.diagnosis.tables import grained

pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(not chromium.binary(), reason=chromium.WHY_NOT),
]
LONG = f"recordings/{'a_name_without_a_break_' * 5}.mcap"

CUT = """[...document.querySelectorAll(".wide")].filter(one => one.scrollWidth > one.clientWidth)
.map(one => one.querySelector("caption").innerText)"""
"""The captions of the tables that are wider than the page."""

HIDDEN = """(() => {
const wide = [...document.querySelectorAll("figure, figure *")].filter(one => one.scrollWidth > one.clientWidth + 1);
wide.forEach(one => one.scrollLeft = one.scrollWidth);
return [...document.querySelectorAll("figcaption")].map(one => one.getBoundingClientRect())
.filter(box => box.left < 0 || box.right > innerWidth).length; })()"""
"""The captions of which a part is beside the page once every drawing has scrolled to its end."""

NARROWEST = """Math.min(...[...document.querySelectorAll("td")].filter(one => one.innerText.length > 60)
.map(one => one.clientWidth))"""
"""The width of the narrowest cell with a sentence in it, px."""

LETTERS = """[...document.querySelectorAll("figure svg text")].map(one => one.getBoundingClientRect())
.map(box => Math.min(box.width, box.height)).filter(height => height > 0)"""
"""The heights of the lines of text in the drawings, px."""

QUALITIES = ("onset_rmse_deg", "onset_median_deg", "path_rmse_mm", "path_median_mm", "turn_rmse_deg", "turn_median_deg")

DRAWING = (
    '<svg width="400" height="300"><text x="40" y="40">a</text><circle cx="200" cy="150" r="50" fill="#0072b2"/></svg>'
)


def test_a_long_command_does_not_make_the_page_wider(tmp_path: Path) -> None:
    stops = [stop(angle, {"imu": [angle + 0.1, angle + 0.3]}, index=angle) for angle in range(4)]
    report = tmp_path / "report.html"
    report.write_text(comparison_page(compare(stops, readings=2), source=LONG), encoding="utf-8")
    with chromium.browser(tmp_path / "profile") as page:
        page.size(390, 844, phone=True)
        page.open(report.as_uri())
        assert LONG in page.text("figcaption code")
        assert page.of("document.documentElement.scrollWidth") <= 390


def test_a_drawing_keeps_its_letters_on_a_phone_and_scrolls_in_its_own_box(tmp_path: Path) -> None:
    found, report = grained(), tmp_path / "report.html"
    report.write_text(html_page(found.diagnosis, found.pictures), encoding="utf-8")
    with chromium.browser(tmp_path / "profile") as page:
        page.size(390, 844, phone=True)
        page.open(report.as_uri())
        heights = page.of(LETTERS)
        assert len(heights) > 50
        assert np.median(heights) >= 7.0, "px; nobody reads smaller letters"
        assert page.of(NARROWEST) >= 100, "px; a sentence in a narrower column has a word a line"
        assert page.of(HIDDEN) == 0, "the captions stay while their drawings scroll"
        assert page.of("document.documentElement.scrollWidth") <= 390


def test_no_table_of_a_diagnosis_is_cut_on_a_laptop(tmp_path: Path) -> None:
    """The quality before and after has the most columns, and the most numbers in them, where slides were seen."""
    found = grained()
    errors = dict.fromkeys(QUALITIES, 0.17)
    quality = replace(found.diagnosis.fit.before, **dict.fromkeys(QUALITIES, 49.1), log_score=225.47, se=errors)
    fit = replace(found.diagnosis.fit, before=quality, after=quality)
    report = tmp_path / "report.html"
    report.write_text(html_page(replace(found.diagnosis, fit=fit), found.pictures), encoding="utf-8")
    with chromium.browser(tmp_path / "profile") as page:
        page.size(1200, 900)
        page.open(report.as_uri())
        assert page.of(CUT) == []


@pytest.mark.parametrize("dark", [False, True])
def test_a_figure_is_drawn_on_the_pages_own_paper(dark: bool, tmp_path: Path) -> None:
    """A white box would blind who reads in the dark; colours keep their hues there."""
    report, shot = tmp_path / "report.html", tmp_path / "shot.png"
    with made_by("station"):
        drawn = figure(DRAWING, Caption(shows="b", count="1"))
    report.write_text(whole_page(title="a", body=drawn), encoding="utf-8")
    with chromium.browser(tmp_path / "profile") as page:
        page.size(800, 600, dark=dark)
        page.open(report.as_uri())
        left, top = (round(page.of(f"document.querySelector('svg').getBoundingClientRect().{side}")) for side in "xy")
        page.picture(shot)
    seen = np.asarray(cv2.imread(str(shot))).astype(int)
    beside, figures_paper, circle = seen[top, left - 8], seen[top + 100, left + 100], seen[top + 150, left + 200]
    assert np.abs(figures_paper - beside).max() <= 4
    assert circle.argmax() == 0, "the circle is blue"
