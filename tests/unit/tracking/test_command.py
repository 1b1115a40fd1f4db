"""`pi-agent track`: a line a frame, and one clear sentence for what is no picture."""

import argparse
import json
from dataclasses import fields
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pi_agent.rendering import FastRenderer, Pose, Scene, surface
from pi_agent.tracking.command import add_arguments, run
from pi_agent.tracking.mark import Mark
from shared.errors import UserError
from shared.messages import MarkerCorners
from tests.benchmarks.tracking_rivals.conditions import slowing

MARK = Mark(side_mm=12.0, margin=0.16, feature="dot")
OPTIONS = ["--json", "--margin", "0.16", "--feature", "dot"]


@pytest.fixture(scope="module")
def frames() -> list[tuple[NDArray[np.uint8], NDArray[np.float64]]]:
    rng = np.random.default_rng(1)
    renderer = FastRenderer(Scene(surface("wood", rng=rng), mark=MARK), rng=rng)
    return [renderer.render(Pose(0.2 * number, 0.1, 0.3)) for number in range(4)]


def _run(*arguments: str) -> int:
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    return run(parser.parse_args(list(arguments)))


def test_pictures_give_a_line_each_with_the_fields_of_the_message(
    frames: list[tuple[NDArray[np.uint8], NDArray[np.float64]]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    paths = [str(tmp_path / f"{number}.png") for number in range(len(frames))]
    for path, (frame, _) in zip(paths, frames, strict=True):
        cv2.imwrite(path, frame)
    assert _run(*paths, *OPTIONS) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [line["path"] for line in lines] == paths
    assert set(lines[0]) == {"path", *(field.name for field in fields(MarkerCorners))}
    for line, (_, truth) in zip(lines, frames, strict=True):
        np.testing.assert_allclose(np.reshape(line["corners_px"], (4, 2)), truth, atol=0.1)


def test_a_video_is_a_sequence(
    frames: list[tuple[NDArray[np.uint8], NDArray[np.float64]]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "slide.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 50.0, (600, 600), False)
    for frame, _ in frames:
        writer.write(frame)
    writer.release()
    assert _run(str(path), *OPTIONS) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [line["seq"] for line in lines] == [0, 1, 2, 3]
    assert [line["capture_ns"] for line in lines] == [0, 20_000_000, 40_000_000, 60_000_000]
    assert all(line["found"] for line in lines)


def test_a_rolling_shutter_that_is_not_told_is_asked_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    trial, path = slowing(np.random.default_rng([6, 20])), tmp_path / "slide.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"FFV1"), 90.0, (600, 600), False)
    for frame in trial.frames:
        writer.write(frame)
    writer.release()
    assert _run(str(path), *OPTIONS) == 1
    assert "--line-us" in capsys.readouterr().err
    assert _run(str(path), *OPTIONS, "--line-us", "17", "--exposure-ms", "2") == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert {json.loads(line)["exposure_ns"] for line in said.out.splitlines()} == {2_000_000}


def test_an_empty_scene_is_said_and_ends_with_1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "grey.png"
    cv2.imwrite(str(path), np.full((600, 600), 90, dtype=np.uint8))
    assert _run(str(path)) == 1
    assert "not found: no mark in this frame" in capsys.readouterr().out


@pytest.mark.parametrize(("light", "said"), [(0, "the picture is black"), (255, "the picture is saturated")])
def test_too_little_and_too_much_light_are_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], light: int, said: str
) -> None:
    path = tmp_path / "light.png"
    cv2.imwrite(str(path), np.full((600, 600), light, dtype=np.uint8))
    assert _run(str(path), "--json") == 1
    assert json.loads(capsys.readouterr().out)["reason"].lower().startswith(said)


def test_a_video_that_breaks_off_is_said_after_its_frames(
    frames: list[tuple[NDArray[np.uint8], NDArray[np.float64]]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "spoiled.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 50.0, (600, 600), False)
    for frame, _ in 5 * frames:
        writer.write(frame)
    writer.release()
    data = bytearray(path.read_bytes())
    half = len(data) // 2
    data[half : half + len(data) // 4] = np.random.default_rng(2).bytes(len(data) // 4)
    path.write_bytes(data)
    with pytest.raises(UserError, match=r"frames can be decoded where the file says that it holds 20"):
        _run(str(path), *OPTIONS)
    assert len(capsys.readouterr().out.splitlines()) >= 5


@pytest.mark.parametrize("name", ["noise.png", "noise.mp4", "noise", "empty.jpg"])
def test_garbage_is_one_clear_sentence(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(b"" if "empty" in name else np.random.default_rng(1).bytes(4000))
    with pytest.raises(UserError, match="expected a picture"):
        _run(str(path))


def test_a_folder_gives_its_pictures_and_an_unreadable_one_does_not_hide_the_others(
    frames: list[tuple[NDArray[np.uint8], NDArray[np.float64]]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for number, (frame, _) in enumerate(frames[:3]):
        cv2.imwrite(str(tmp_path / f"{number}.png"), frame)
    (tmp_path / "notes.txt").write_text("not a picture")
    assert _run(str(tmp_path), *OPTIONS) == 0
    assert len(capsys.readouterr().out.splitlines()) == 3
    (tmp_path / "1.png").write_bytes(b"")
    assert _run(str(tmp_path), *OPTIONS) == 2
    said = capsys.readouterr()
    assert [Path(json.loads(line)["path"]).name for line in said.out.splitlines()] == ["0.png", "2.png"]
    assert said.err.count("\n") == 1
    assert "1.png: expected a picture" in said.err


def test_missing_files_folders_and_odd_options_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no such file"):
        _run(str(tmp_path / "nothing.png"))
    with pytest.raises(UserError, match="folder without pictures"):
        _run(str(tmp_path))
    with pytest.raises(UserError, match="--tag"):
        _run("x.png", "--tag", "NONSENSE")
    with pytest.raises(UserError, match="--side-px"):
        _run("x.png", "--side-px", "90", "40")
    with pytest.raises(UserError, match="--exposure-ms"):
        _run("x.png", "--exposure-ms", "-2")
    with pytest.raises(UserError, match="--line-us"):
        _run("x.png", "--line-us", "nan")
