"""The same work for each recording: kept by content and version, and stopped by none that cannot be read."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import pytest

from shared.errors import UserError
from station.app.many.each import Kept, Result, Row, each
from station.app.many.index import INDEX, read_index, write_index

VERSION = "0123456789" * 7


def measured(path: Path, name: str, *, log: Path) -> Result:
    """A recording of digits; the log gets a letter for each time that one is read."""
    with log.open("a", encoding="utf-8") as file:
        file.write("x")
    text = path.read_text(encoding="utf-8")
    if text == "bug":
        raise ZeroDivisionError("by nothing")
    if not text.isdigit():
        raise UserError(f"{path} is damaged: {text}")
    return {"recording": name, "value": int(text)}


class Lab:
    """A folder of recordings, worked through."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.log, self.out = folder, folder / "log", folder / "out"
        for name, text in (("a", "1"), ("b", "torn"), ("c", "2")):
            self.path(name).write_text(text, encoding="utf-8")

    def path(self, name: str) -> Path:
        return self.folder / f"{name}.mcap"

    def rows(self, names: str, *, key: str = VERSION, jobs: int = 1, keep: bool = True) -> list[Row]:
        kept = Kept(folder=self.out, key=key) if keep else None
        return each([str(self.path(it)) for it in names], partial(measured, log=self.log), kept=kept, jobs=jobs)

    def worked(self) -> int:
        times = len(self.log.read_text(encoding="utf-8")) if self.log.exists() else 0
        self.log.unlink(missing_ok=True)
        return times


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    return Lab(tmp_path)


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_damaged_recording_is_a_row_with_its_reason(lab: Lab, jobs: int) -> None:
    rows = lab.rows("cba", jobs=jobs)
    assert [row.status for row in rows] == ["done", "failed", "done"]
    assert [row.result.get("value") for row in rows] == [2, None, 1]
    assert rows[1].reason.endswith("is damaged: torn")


def test_a_fault_of_this_program_stops_no_other_recording(lab: Lab) -> None:
    lab.path("b").write_text("bug", encoding="utf-8")
    rows = lab.rows("abc")
    assert [row.status for row in rows] == ["done", "failed", "done"]
    assert "ZeroDivisionError: by nothing" in rows[1].reason


def test_a_missing_recording_is_a_row_as_well(lab: Lab) -> None:
    lab.path("c").unlink()  # after it was named
    assert [row.status for row in lab.rows("ac")] == ["done", "failed"]


def test_what_is_there_is_not_done_again_unless_content_or_version_change(lab: Lab) -> None:
    lab.rows("ac")
    assert lab.worked() == 2
    assert [row.status for row in lab.rows("ac")] == ["kept", "kept"]
    assert lab.worked() == 0
    lab.path("c").write_text("3", encoding="utf-8")
    assert [(row.status, row.result["value"]) for row in lab.rows("ac")] == [("kept", 1), ("done", 3)]
    assert [row.status for row in lab.rows("ac", key=VERSION[::-1])] == ["done", "done"]


def test_a_result_is_found_under_another_name_and_tells_it(lab: Lab) -> None:
    lab.rows("a")
    lab.path("a").rename(lab.path("z"))
    (row,) = lab.rows("z")
    assert (row.status, row.result["recording"]) == ("kept", str(lab.path("z")))


def test_a_result_that_was_torn_is_made_anew(lab: Lab) -> None:
    (row,) = lab.rows("a")
    (lab.out / row.file).write_text('{"recording": ', encoding="utf-8")
    assert [one.status for one in lab.rows("a")] == ["done"]
    assert json.loads((lab.out / row.file).read_text(encoding="utf-8"))["value"] == 1


def test_without_a_folder_nothing_is_written(lab: Lab) -> None:
    assert [row.status for row in lab.rows("ac", keep=False)] == ["done", "done"]
    assert not lab.out.exists()


def test_a_result_counts_while_its_files_are_there(tmp_path: Path) -> None:
    kept = Kept(folder=tmp_path, key=VERSION)
    kept.file("d1").parent.mkdir()
    kept.file("d1").write_text('{"recording": "a", "files": ["part"]}', encoding="utf-8")
    assert kept.found("d1", "a") is None
    (tmp_path / "part").touch()
    assert kept.found("d1", "a") is not None
    assert kept.found("d1", "b") is None, "the file has the old name in it"


def test_the_index_has_a_line_for_each_and_keeps_those_of_before(lab: Lab) -> None:
    kept = Kept(folder=lab.out, key=VERSION)
    write_index(kept, lab.rows("ab"))
    write_index(kept, lab.rows("c"))
    lines = read_index(lab.out / INDEX)
    assert [Path(name).stem for name in lines] == ["a", "b", "c"]
    files = [line["file"] for line in lines.values()]
    assert [bool(file) and (lab.out / file).exists() for file in files] == [True, False, True]
    assert "torn" in lines[str(lab.path("b"))]["reason"]
