"""A file that cannot be written is told of before the work is done, and nothing is left behind."""

from __future__ import annotations

from pathlib import Path

import pytest

from shared.errors import UserError
from station.__main__ import main as station
from station.app.outputs import require_writable


def test_a_file_that_can_be_written_is_left_as_it_was(tmp_path: Path) -> None:
    (tmp_path / "old.html").write_text("kept", encoding="utf-8")
    require_writable(tmp_path / "old.html", what="report")
    require_writable(tmp_path / "new.html", what="report")
    assert [path.read_text(encoding="utf-8") for path in tmp_path.iterdir()] == ["kept"]


@pytest.mark.parametrize("name", ["", "file/report.html", "none/report.html"])
def test_a_place_where_nothing_can_be_written_is_named(name: str, tmp_path: Path) -> None:
    (tmp_path / "file").touch()  # root neither can write below a file
    with pytest.raises(UserError, match="Expected to write the report to"):
        require_writable(tmp_path / name, what="report")


@pytest.mark.parametrize(
    "line",
    [
        "diagnose samples.csv --report file/a.html",
        "diagnose samples.csv --model file/model.toml",
        "diagnose sim.mcap --overlay file/a.rrd",
        "arm plan --picture file/a.png",
    ],
)
def test_commands_that_take_minutes_say_it_first(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The recordings are not even looked for."""
    monkeypatch.chdir(tmp_path)
    Path("file").touch()
    assert station(line.split()) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert f"to {line.rpartition(' ')[2]}, but that failed" in said.err
