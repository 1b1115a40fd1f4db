"""`station analyze` over files: what it prints, writes and answers for good and bad ones."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from shared.errors import UserError
from shared.messages import Sample
from shared.system import desktop
from station.__main__ import main
from station.app import analysis_files, sessions
from station.recording.tables import read_samples, write_samples
from station.recording.writer import Recording
from station.view import viewer
from tests.unit.friction.sessions import GEOMETRY, sample, session
from tests.unit.recording.session import START_NS, provenance


def recorded(samples: Sequence[Sample], path: Path) -> Path:
    """A recording that holds these samples and a calibration."""
    with Recording(path, provenance=provenance()) as recording:
        recording.write_message("camera/geometry", replace(GEOMETRY, stamp_ns=START_NS), receive_ns=START_NS)
        for one in samples:
            recording.write_message("session/sample", one, receive_ns=START_NS + one.start_ns)
    return path


def table(samples: Sequence[Sample], path: Path) -> Path:
    write_samples(samples, path)
    return path


def wood_on_wood(count: int, seed: int) -> list[Sample]:
    planted = session(count, rng=np.random.default_rng(seed), mu=lambda phi: 0.4 * math.exp(0.14 * math.cos(2 * phi)))
    return [replace(one, object="wood", plate="wood") for one in planted]


class Links(HTMLParser):
    """The links that a page loads, and its list items."""

    def __init__(self) -> None:
        super().__init__()
        self.sources: list[str] = []
        self.tags: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.sources += [value or "" for name, value in attrs if name in ("src", "href")]


def test_two_files_become_pairs_with_tables_figures_and_a_report_in_one_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    odd = [sample(run=901, slide_m=0.001), sample(run=902, slide_m=0.002), replace(sample(run=903), censored=True)]
    first = recorded([*session(80, rng=np.random.default_rng(1)), *odd], tmp_path / "one.mcap")
    second = recorded(wood_on_wood(120, 2), tmp_path / "two.mcap")
    out = tmp_path / "out"
    assert main(["analyze", str(first), str(second), "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    # Table III: pair, slid, unique, %, total, distance, angle, circumference, border, censored.
    row = next(line for line in printed.splitlines() if line.startswith("│ cube on wood ") and "2.4 %" in line)
    assert re.findall(r"[\d.]+(?: %)?", row) == ["82", "2", "2.4 %", "2", "2", "0", "0", "0", "1"]
    assert "Friction depends on the sliding direction against the object" in printed.split("wood on wood\n")[-1]
    page = (out / "report.html").read_text(encoding="utf-8")
    links = Links()
    links.feed(page)
    assert links.tags.count("img") == 12
    assert all(source.startswith("data:image/png;base64,") for source in links.sources)
    assert "http" not in re.sub(r"base64,[A-Za-z0-9+/=]+", "", page)
    assert len(list((out / "figures").glob("*.png"))) == len(list((out / "figures").glob("*.pdf"))) == 12
    assert (out / "figures.rrd").stat().st_size > 10_000
    written = {one.run: one.flags for one in read_samples(out / "samples.parquet") if one.object == "cube"}
    assert len(written) == 83
    assert {run: flags for run, flags in written.items() if flags} == {901: ("distance",), 902: ("distance",)}
    assert len(read_samples(out / "samples.csv")) == 203


def test_its_own_table_gives_the_same_numbers_with_the_calibration_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(analysis_files, "figure_kinds", tuple)  # figures are looked at elsewhere, and take seconds
    mcap = recorded(session(60, rng=np.random.default_rng(4)), tmp_path / "one.mcap")
    assert main(["analyze", str(mcap), "--out", str(tmp_path / "a")]) == 0
    direct = capsys.readouterr().out.split("Report:")[0]
    again = [str(tmp_path / "a" / "samples.csv"), "--calibration", str(mcap), "--out", str(tmp_path / "b")]
    assert main(["analyze", *again]) == 0
    assert capsys.readouterr().out.split("Report:")[0] == direct


def test_rerun_is_opened_on_request_and_where_there_is_a_display(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(analysis_files, "figure_kinds", tuple)
    path, out, opened = table([sample()], tmp_path / "t.csv"), tmp_path / "out", list[Path]()
    monkeypatch.setattr(viewer, "open_file", opened.append)
    monkeypatch.setattr(desktop, "has_display", lambda: True)
    assert main(["analyze", str(path), "--out", str(out)]) == 1
    assert opened == []
    assert main(["analyze", str(path), "--out", str(out), "--rerun"]) == 1
    assert opened == [out / "figures.rrd"]
    monkeypatch.setattr(desktop, "has_display", lambda: False)
    capsys.readouterr()
    assert main(["analyze", str(path), "--out", str(out), "--rerun"]) == 1
    assert f"rerun {out / 'figures.rrd'}" in capsys.readouterr().out.splitlines()[-1]
    assert len(opened) == 1


def test_large_recordings_are_read_with_all_cores_to_the_same_sessions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    paths = [recorded(session(9, rng=np.random.default_rng(seed)), tmp_path / f"{seed}.mcap") for seed in range(3)]
    alone = sessions.read_sessions(paths)
    monkeypatch.setattr(sessions, "_WORTH_A_PROCESS_BYTES", 0)
    together = sessions.read_sessions(paths, jobs=2)
    assert [one.source for one in together] == [str(path) for path in paths]
    assert [(one.samples, one.geometry) for one in together] == [(one.samples, one.geometry) for one in alone]
    paths[1].write_bytes(b"no recording")
    with pytest.raises(UserError, match="another kind of file"):
        sessions.read_sessions(paths, jobs=2)


def test_what_cannot_be_concluded_is_said_and_ends_with_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(analysis_files, "figure_kinds", tuple)
    path = table([replace(one, object="<b>&") for one in session(10, rng=np.random.default_rng(4))], tmp_path / "t.csv")
    assert main(["analyze", str(path), "--out", str(tmp_path / "out")]) == 1
    printed = " ".join(capsys.readouterr().out.split())
    assert "! Fewer than 25 samples are kept (10)" in printed
    assert "! There is no calibration" in printed
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "<b>&" not in page
    assert "&lt;b&gt;&amp; on wood" in page


def test_mistakes_are_one_sentence_and_end_with_two(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    degrees = table([sample(run=7, angle_rad=21.3)], tmp_path / "degrees.csv")
    empty = table([], tmp_path / "empty.csv")
    fine = table([sample()], tmp_path / "fine.csv")
    recording = recorded(session(5, rng=np.random.default_rng(1)), tmp_path / "five.mcap")
    copied = table(read_samples(recording), tmp_path / "five.csv")
    broken_off = tmp_path / "a.mcap.partial"
    broken_off.write_bytes(recording.read_bytes()[:2000])
    bare = tmp_path / "bare.mcap"
    with Recording(bare, provenance=provenance()):
        pass
    for words, expected in (
        ([str(degrees)], "run 7: expected onset_angle_rad between 0 and 1.571, got 21.3; are these degrees?"),
        ([str(empty)], "Expected samples in"),
        ([str(tmp_path / "none.csv")], "none.csv"),
        ([str(recording), str(copied)], f"5 of {copied} are in {recording}, too; name only one of the two"),
        ([str(broken_off)], f"was broken off; run: station repair {broken_off}"),
        ([str(fine), "--cutout-mm", "-1"], "--cutout-mm"),
        ([str(fine), "--calibration", str(bare)], "calibration"),
        ([str(fine), "--out", str(fine / "below")], "Expected to write to the folder"),
    ):
        assert main(["analyze", *words, *([] if "--out" in words else ["--out", str(tmp_path / "o")])]) == 2
        error = capsys.readouterr().err
        assert expected in error
        assert len(error.strip().splitlines()) == 1
