"""The fault table finds its rows, says what is bad, and one row of it runs on real processes."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from math import nan
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.faults.__main__ import is_bad, main
from tests.faults.row import Row, all_rows
from tests.faults.sabotaged import half_covered
from tests.faults.trial import Outcome, line_of

GOOD = Outcome("row", 900, 0, 0, 0, True, 0.1, 0.0, 4.0, "the run went on", "gap")
ROW = Row("row", lambda _lab, _random: None)


def test_every_row_has_a_name_of_its_own(capsys: pytest.CaptureFixture[str]) -> None:
    names = [row.name for row in all_rows()]
    assert len(names) == len(set(names)) > 40
    assert main(["--list", "--row", "SIGSTOP"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 16


@pytest.mark.parametrize("centre_px", [(150.0, 150.0), (450.0, 200.0), (450.0, 450.0)])
@pytest.mark.parametrize("yaw_rad", [0.0, 0.5])
def test_half_of_the_mark_is_covered_wherever_the_block_lies(centre_px: tuple[float, float], yaw_rad: float) -> None:
    """The left half of the picture was covered, and a block that had slid to the right was seen whole."""
    square = 40.0 * np.exp(1j * (yaw_rad + np.pi / 2 * np.arange(4)))
    corners_px = np.column_stack([square.real, square.imag]) + centre_px
    mark = cv2.fillPoly(np.zeros((600, 600), np.uint8), [corners_px.round().astype(np.int32)], (1,)) == 1
    covered = half_covered(np.full((600, 600), 255, np.uint8), corners_px) != 255
    assert covered[mark].mean() == pytest.approx(0.5, abs=0.02)
    assert covered.mean() < 0.05


def test_where_no_mark_is_seen_nothing_is_covered() -> None:
    image = np.full((600, 600), 255, np.uint8)
    assert half_covered(image, np.empty((0, 2))) is image


@pytest.mark.parametrize(
    "change",
    [{"lost": 1}, {"lost": 2, "counted": 1}, {"lost_samples": 1}, {"valid": False}, {"rose_deg": 3.0}],
)
def test_what_is_bad_is_said(change: dict[str, float]) -> None:
    assert not is_bad(ROW, [GOOD])
    assert is_bad(ROW, [GOOD, replace(GOOD, **change)])  # pyright: ignore[reportArgumentType]


def test_what_was_lost_and_told_of_and_a_run_that_goes_on_by_right_are_not_bad() -> None:
    assert not is_bad(ROW, [replace(GOOD, lost=2, counted=2)])
    assert not is_bad(replace(ROW, blind=False), [replace(GOOD, rose_deg=20.0)])


def test_a_line_says_how_many_did_not_recover() -> None:
    line = line_of("row", [GOOD, replace(GOOD, recovery_s=nan)], ["trial 2: no"], ROW)
    assert line["next tilt after s"] == "4 (4), 1 not in 90 s"
    assert line["n"] == 2
    assert line["corners lost"] == "0 of 1800"
    assert line["failed"] == "trial 2: no"


def test_trials_of_several_calls_make_one_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    name = next(row.name for row in all_rows())
    files = [tmp_path / "monday.json", tmp_path / "friday.json"]
    words = ["--row", name, *(word for file in files for word in ("--kept", str(file)))]
    for file, lost in zip(files, (0, 3), strict=True):
        file.write_text(json.dumps([asdict(replace(GOOD, row=name, lost=lost, counted=lost))]), encoding="utf-8")
    assert main(words) == 0
    assert "| 2 | 3 of 1800 | 3 | 0 | 2/2 |" in capsys.readouterr().out
    files[1].write_text(json.dumps([{"row": name, "failed": "trial 0: no camera"}]), encoding="utf-8")
    assert main(words) == 1
    assert "trial 0: no camera" in capsys.readouterr().out
    files[1].write_text(json.dumps([asdict(replace(GOOD, row="no such row"))]), encoding="utf-8")
    with pytest.raises(SystemExit, match="no such row"):
        main(words)


@pytest.mark.system
@pytest.mark.benchmark
def test_one_row_on_real_processes(capsys: pytest.CaptureFixture[str]) -> None:
    status = main(["--row", "SIGSTOP camera 2", "--times", "1"])
    assert status == 0, capsys.readouterr().out
