"""The columns that station/diagnosis/README.md names exist, and those that exist are named."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

from shared.messages import Sample
from station.recording.measured import GROUPS, NUMBERS

README = (Path(__file__).parents[3] / "station" / "diagnosis" / "README.md").read_text(encoding="utf-8")


def test_every_column_that_it_names_is_read() -> None:
    table = README.partition("## Tables")[2].partition("**Order.**")[0]
    rows = [line.split("|")[1] for line in table.splitlines() if line.startswith("| ")][1:]
    named = {name.strip() for row in rows for name in row.split(",")}
    more = {*NUMBERS, *GROUPS}
    assert named <= {spec.name for spec in fields(Sample)} | more
    assert more <= named
    assert "onset_angle_rad" in named
