from __future__ import annotations

import csv
import io
import re
from pathlib import Path

import pytest

from shared.errors import UserError
from station.angles.compare import Comparison, compare
from station.angles.figure import write_figure
from station.angles.page import comparison_page
from station.angles.report import fits_csv, table_csv, text_of
from station.pages.caption import made_by
from tests.unit.angles.test_compare import stop


@pytest.fixture
def comparison() -> Comparison:
    up_and_down = [(0, 1), (1, 1), (2, 1), (1, -1), (0, -1)]
    return compare(
        [
            stop(angle, {"imu": [angle + 0.1, angle + 0.3], "mocap": [angle + 0.5, angle + 0.5]}, approach=way, index=i)
            for i, (angle, way) in enumerate(up_and_down)
        ],
        readings=2,
    )


def test_the_table_is_square_and_symmetric_with_the_reference_first(comparison: Comparison) -> None:
    lines = text_of(comparison).splitlines()
    assert lines[1].split() == ["degrees", "commanded", "imu", "mocap"]
    cells = [line.split("  ") for line in lines[3:6]]
    rows = [[cell.strip() for cell in row if cell.strip()] for row in cells]
    assert rows[0][1:] == ["0 ± 0", "0.20 ± 0.11", "0.50 ± 0.00"]
    assert [row[0] for row in rows] == ["commanded", "imu", "mocap"]
    assert [[row[i + 1] for row in rows] for i in range(3)] == [row[1:] for row in rows]


def test_the_fits_are_printed_with_their_intervals(comparison: Comparison) -> None:
    mocap = next(line for line in text_of(comparison).splitlines()[6:] if line.startswith("mocap"))
    assert "+0.500 [+0.500, +0.500]" in mocap
    assert "1.0000 [1.0000, 1.0000]" in mocap


def test_nothing_has_no_sign() -> None:
    """The last digit of a sum of equal angles is a matter of rounding."""
    same = compare([stop(angle, {"imu": [angle - 1e-9] * 2}, index=i) for i, angle in enumerate((0, 1, 2))], readings=2)
    imu = next(line for line in text_of(same).splitlines()[6:] if line.startswith("imu"))
    assert "+0.000 [+0.000, +0.000]" in imu
    assert "-0.000" not in text_of(same)


def test_the_csv_files_hold_the_same_numbers(comparison: Comparison) -> None:
    pairs = list(csv.DictReader(io.StringIO(table_csv(comparison))))
    assert len(pairs) == 3
    assert float(pairs[0]["mean_abs_deg"]) == pytest.approx(0.2)
    fits = {row["source"]: row for row in csv.DictReader(io.StringIO(fits_csv(comparison)))}
    assert float(fits["mocap"]["offset_deg"]) == pytest.approx(0.5)
    assert fits["mocap"]["reference"] == "commanded"


def test_what_is_not_determined_is_empty_and_said() -> None:
    found = compare([stop(0.0, {"a": [0.1, 0.1]}), stop(1.0, {"a": []}, index=1)], readings=2)
    assert "a: readings at 1 of 2 stops only." in text_of(found)
    row = next(csv.DictReader(io.StringIO(fits_csv(found))))
    assert row["gain"] == ""


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_the_figure_is_drawn(comparison: Comparison, tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"figure.{suffix}"
    with made_by("station compare-angles --from a.mcap"):
        write_figure(comparison, path)
    data = path.read_bytes()
    assert data[:8].startswith({"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}[suffix])
    assert len(data) > 5000


def test_a_figure_of_an_unknown_kind_is_told(comparison: Comparison, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="png, svg or pdf"), made_by("station compare-angles"):
        write_figure(comparison, tmp_path / "figure.docx")


def test_the_page_has_every_number_the_figure_and_its_command(comparison: Comparison) -> None:
    page = comparison_page(comparison, source="a & b.mcap")
    assert page.count("<svg") == 1
    assert "station compare-angles --from &#x27;a &amp; b.mcap&#x27;" in page
    for fit in comparison.fits:
        assert f"<td>{fit.source}</td>" in page
    assert "nan" not in re.sub("<svg.*?</svg>", "", page, flags=re.DOTALL)
    for elsewhere in ("<script", "src=", "@import"):
        assert elsewhere not in page
