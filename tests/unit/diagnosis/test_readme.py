"""The columns that station/diagnosis/README.md names exist."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

from shared.messages import Sample

README = (Path(__file__).parents[3] / "station" / "diagnosis" / "README.md").read_text(encoding="utf-8")


def test_every_column_that_it_names_is_one_of_a_sample() -> None:
    table = README.partition("## Tables")[2].partition("## In a notebook")[0]
    rows = [line.split("|")[1] for line in table.splitlines() if line.startswith("| ")][1:]
    named = {name.strip() for row in rows for name in row.split(",")}
    assert named <= {spec.name for spec in fields(Sample)}
    assert "onset_angle_rad" in named
