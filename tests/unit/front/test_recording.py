"""Opening recordings, good and bad, and what they show."""

from __future__ import annotations

from pathlib import Path

import pytest

import station
from station.__main__ import main
from station.recording.tables import write_samples
from station.recording.writer import Recording
from tests.unit.diagnosis.page import Page
from tests.unit.diagnosis.recorded import GOLDEN
from tests.unit.diagnosis.tables import samples
from tests.unit.recording import session


def test_it_prints_what_was_recorded() -> None:
    said = repr(station.open(str(GOLDEN)))
    assert said.startswith(f"{GOLDEN}: 3 samples; 26.9 s from 2020-09-13 12:26:40 UTC")
    assert "22.39" in said
    assert "Note: the rig is a simulation: the mount of its camera sags" in said
    assert max(map(len, said.splitlines()[1:])) <= 120


def test_a_notebook_shows_it_with_a_figure_that_fetches_nothing() -> None:
    page = Page(station.open(GOLDEN)._repr_html_())  # pyright: ignore[reportPrivateUsage]
    assert page.figures == 1
    assert [place for place in page.fetched if not place.startswith("data:")] == []
    assert "Onset angle by direction" in page.text
    assert "22.39" in page.text


def test_a_table_shows_its_columns_and_first_values() -> None:
    events = station.open(GOLDEN).events
    assert repr(events).splitlines()[0] == f"events of {GOLDEN}: 113 rows"
    assert "  phase    'SYNC', 'STEP_BEGIN', 'STEP_END', …" in repr(events).splitlines()
    page = Page(events._repr_html_())  # pyright: ignore[reportPrivateUsage]
    assert "phase" in page.text
    assert "STEP_BEGIN" in page.text


def test_columns_that_hold_nothing_take_one_line(tmp_path: Path) -> None:
    """A table of tracks has no picture: two dozen lines of nan would hide what it has."""
    rows = ["run,t_s,x_m,y_m,yaw_rad,tilt_rad,azimuth_rad"]
    rows += [
        f"{run},{step / 100},{max(0.0, step / 100 - 2.0) ** 3 / 10},0,0,{0.15 * step / 100},1.57"
        for run in (1, 2)
        for step in range(300)
    ]
    (tmp_path / "t.csv").write_text("\n".join(rows), encoding="utf-8")
    assert main(["import", "tracks", str(tmp_path / "t.csv"), "--out", str(tmp_path / "t.mcap")]) == 0
    said = repr(station.open(str(tmp_path / "t.mcap")).samples).splitlines()
    assert not [line for line in said if "nan, nan" in line]
    assert said[-1].startswith("  nothing in euler_rad_0, ")
    assert "temperature_c" in said[-1]


def test_what_comes_from_outside_is_escaped(tmp_path: Path) -> None:
    path = session.record(tmp_path / "<script>a&b.mcap")
    for shown in (station.open(path), station.open(path).samples):
        text = shown._repr_html_()  # pyright: ignore[reportPrivateUsage]
        assert "<script" not in text
        assert "<script>a&b.mcap" in Page(text).text


def test_a_session_without_samples_says_so_and_only_what_needs_them_refuses_it(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    Recording(path, provenance=session.provenance()).close()
    empty = station.open(path)
    assert "no samples: no run of the session came to its end" in repr(empty)
    assert Page(empty._repr_html_()).figures == 0  # pyright: ignore[reportPrivateUsage]
    assert len(empty.samples) == len(empty.corners) == len(empty.poses) == len(empty.attitude) == 0
    for recording in (empty, path):
        with pytest.raises(station.UserError, match=r"Expected samples in .*a.mcap, but there is none"):
            station.analyze(recording)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("none.mcap", None, "Expected a recording at .*none.mcap, but it cannot be read: No such file"),
        ("empty.mcap", b"", "Expected a recording, but .*empty.mcap is empty"),
        ("text.mcap", b"run,onset\n1,2\n", "is another kind of file"),
        ("half.mcap", GOLDEN.read_bytes()[:200_000], "breaks off before its end; run: station repair"),
    ],
)
def test_a_file_that_is_no_recording_is_said_in_one_sentence(
    name: str, content: bytes | None, said: str, tmp_path: Path
) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    for ask in (station.open, station.diagnose, station.analyze):
        with pytest.raises(station.UserError, match=said) as error:
            ask(tmp_path / name)
        assert "\n" not in str(error.value)


def test_damage_inside_is_said_when_a_table_is_read(tmp_path: Path) -> None:
    content = bytearray(GOLDEN.read_bytes())
    middle = len(content) // 2
    content[middle : middle + 64] = bytes(64)
    (tmp_path / "damaged.mcap").write_bytes(content)
    with pytest.raises(station.UserError, match=r"damaged.mcap is damaged: .*station repair"):
        assert station.open(tmp_path / "damaged.mcap").corners


def test_what_is_no_path_is_said(tmp_path: Path) -> None:
    write_samples(samples(), tmp_path / "table.csv")
    for ask in (station.open, station.diagnose):
        with pytest.raises(station.UserError, match="Expected a recording or the path of a file, got dict"):
            ask({"run": 1})  # pyright: ignore[reportArgumentType]
    with pytest.raises(station.UserError, match="Expected a recording or the path of a file, got int"):
        station.analyze(7)  # pyright: ignore[reportArgumentType]
    with pytest.raises(station.UserError, match="another kind of file"):
        station.open(tmp_path / "table.csv")
