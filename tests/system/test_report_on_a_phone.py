"""A report in a real browser, as wide as a phone: nothing but its tables and figures is wider than the screen."""

from __future__ import annotations

from pathlib import Path

import pytest

from station.angles.compare import compare
from station.angles.page import comparison_page
from tests.system import chromium
from tests.unit.angles.test_compare import stop

pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(not chromium.binary(), reason=chromium.WHY_NOT),
]
LONG = f"recordings/{'a_name_without_a_break_' * 5}.mcap"


def test_a_long_command_does_not_make_the_page_wider(tmp_path: Path) -> None:
    stops = [stop(angle, {"imu": [angle + 0.1, angle + 0.3]}, index=angle) for angle in range(4)]
    report = tmp_path / "report.html"
    report.write_text(comparison_page(compare(stops, readings=2), source=LONG), encoding="utf-8")
    with chromium.browser(tmp_path / "profile") as page:
        page.size(390, 844, phone=True)
        page.open(report.as_uri())
        assert LONG in page.text("figcaption code")
        assert page.of("document.documentElement.scrollWidth") <= 390
