"""CSV tables: a spreadsheet runs none of their cells, and every cell comes back as it was."""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shared.csv_text import csv_lines, plain

_TEXTS = st.text(st.characters(codec="utf-8")) | st.from_regex(r"'{0,3}\s?[=+\-@]\w{0,3}[,;\"\r\n]?", fullmatch=True)


@settings(deadline=None)
@given(rows=st.lists(st.tuples(_TEXTS, _TEXTS, st.floats(allow_nan=False)), max_size=4))
def test_a_table_comes_back_as_it_was(rows: list[tuple[str, str, float]]) -> None:
    read = [[plain(cell) for cell in row] for row in csv.reader(io.StringIO("".join(csv_lines(rows)), newline=""))]
    assert [(first, second, float(number)) for first, second, number in read] == rows


@pytest.mark.parametrize(
    "text", ["=1+1", "+x", "-x", "@SUM(A1)", "\t=1", " =1", "\r=1", "\uff1d1", "-1+1", "+1|2", "-inf"]
)
def test_a_formula_is_a_text(text: str) -> None:
    (line,) = csv_lines([(text, 1)])
    assert line.lstrip('"').startswith("'")


@pytest.mark.parametrize("number", ["-1", "+2.5", "-3.", "-1e-05", "0.25", -0.25, -7])
def test_a_number_stays_one(number: str | float) -> None:
    assert list(csv_lines([(number, "x")])) == [f"{number},x\n"]


def test_nobody_else_writes_tables() -> None:
    root = Path(__file__).parents[3]
    files = [path for part in ("pi_agent", "shared", "station") for path in (root / part).rglob("*.py")]
    writers = re.compile(r"csv\.(writer|DictWriter)|\.to_csv\(|pyarrow\.csv")
    assert [path for path in files if writers.search(path.read_text(encoding="utf-8"))] == []
