"""A table of corner pixels gives the poses of the block whose mark the camera saw, and keeps the pixels."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from shared.errors import UserError
from shared.geometry import Array, mark_corners
from station.friction.onset import estimate_onset
from station.recording.arrays import load_signals
from station.recording.importers import tracks, write
from station.recording.reader import open_recording
from tests.unit.recording.test_tracks import MU, Columns, imported, saved, two_runs

SIDE_M, HEIGHT_M, CAMERA_M = 0.009, 0.012, (0.02, -0.03, 0.3)
TURN = Rotation.from_quat((0.0, 1.0, 0.0, 0.0), scalar_first=True) * Rotation.from_euler("XYZ", (0.12, -0.08, 0.3))
LENS = (-0.2, 0.05, 1e-3, -5e-4)
K = np.array([[1500.0, 0.0, 310.0], [0.0, 1490.0, 290.0], [0.0, 0.0, 1.0]])


def toml(**changes: object) -> str:
    camera = {"fx": 1500.0, "fy": 1490.0, "cx": 310.0, "cy": 290.0, "width_px": 900, "height_px": 900}
    camera |= {"position_m": list(CAMERA_M), "quaternion": TURN.as_quat(scalar_first=True).tolist()}
    camera |= {"distortion": list(LENS)}
    mark = {"side_m": SIDE_M, "height_m": HEIGHT_M}
    for table in (camera, mark):
        table |= {name: value for name, value in changes.items() if name in table}
    return "".join(
        f"[{name}]\n" + "".join(f"{key} = {value}\n" for key, value in table.items())
        for name, table in (("camera", camera), ("mark", mark))
    )


def seen(columns: Columns, rng: np.random.Generator | None = None) -> Columns:
    """The table with the corners that OpenCV's camera sees in place of the poses."""
    pixels = [_pixels(x, y, yaw) for x, y, yaw in zip(columns["x_m"], columns["y_m"], columns["yaw_rad"], strict=True)]
    table = np.array(pixels).reshape(len(pixels), 8)
    table += 0.0 if rng is None else rng.normal(0.0, 0.05, table.shape)
    names = [f"{axis}{corner}" for corner in range(4) for axis in "uv"]
    kept = {name: values for name, values in columns.items() if name not in ("x_m", "y_m", "yaw_rad")}
    return kept | {name: own.tolist() for name, own in zip(names, table.T, strict=True)}


def _pixels(x: float, y: float, yaw: float) -> Array:
    mark = np.column_stack([mark_corners(side_m=SIDE_M), np.zeros(4)])
    places = Rotation.from_euler("Z", yaw).apply(mark) + np.array([x, y, HEIGHT_M])
    back = TURN.inv()
    turn, shift = back.as_rotvec(), -back.apply(CAMERA_M)
    return np.asarray(cv2.projectPoints(places, turn, shift, K, np.array(LENS))[0], dtype=np.float64).reshape(4, 2)


def beside(folder: Path, columns: Columns, text: str) -> Path:
    (folder / "a.toml").write_text(text, encoding="utf-8")
    return saved(columns, folder / "a.csv")


def test_corners_give_the_poses_and_the_onsets(tmp_path: Path) -> None:
    known = two_runs()
    reader = open_recording(imported(beside(tmp_path, seen(known), toml()), tmp_path / "a.mcap"))
    signals = load_signals(reader)
    assert signals.geometry is not None
    pose = signals.corners.pose(signals.geometry)
    wanted = np.column_stack([known["x_m"], known["y_m"], known["yaw_rad"]])
    assert pose == pytest.approx(wanted, abs=2e-6)
    assert not len(signals.block)
    for sample in reader.samples():
        assert sample.onset_angle_rad == pytest.approx(math.atan(MU), abs=2e-3)


def test_the_noise_is_read_from_the_frames_unless_it_is_told(tmp_path: Path) -> None:
    columns = seen(two_runs(), np.random.default_rng(1))
    source = beside(tmp_path, columns, toml())
    write(tracks.read(source, onset=estimate_onset), tmp_path / "a.mcap")
    (told,) = set(load_signals(open_recording(tmp_path / "a.mcap")).corners.sigma_px.tolist())
    assert told == pytest.approx(0.05, rel=0.05)
    beside(tmp_path, columns, toml().replace("[mark]", "sigma_px = 0.2\n[mark]"))
    write(tracks.read(source, onset=estimate_onset), tmp_path / "b.mcap")
    assert set(load_signals(open_recording(tmp_path / "b.mcap")).corners.sigma_px.tolist()) == {0.2}


def test_a_lost_mark_is_said_to_be_lost(tmp_path: Path) -> None:
    columns = seen(two_runs())
    columns["v2"][5] = math.nan
    found = load_signals(open_recording(imported(beside(tmp_path, columns, toml()), tmp_path / "a.mcap"))).corners.found
    assert np.flatnonzero(~found).tolist() == [5]


Change = Callable[[Columns], object]
BAD: dict[str, tuple[Change, str, str]] = {
    "a corner missing": (lambda columns: columns.pop("v3"), toml(), "missing are v3"),
    "places, too": (lambda columns: columns.update(x_m=columns["tilt_rad"]), toml(), "got x beside u0"),
    "another mark": (lambda _: None, toml(side_m=0.012), "a mark of 144 mm² .* enclose 81 mm²; look at side_m"),
    "corners the other way round": (
        lambda columns: columns.update(u1=columns["u3"], v1=columns["v3"], u3=columns["u1"], v3=columns["v1"]),
        toml(),
        "must run clockwise",
    ),
    "a camera below": (lambda _: None, toml(position_m=[0, 0, 0.01]), "a camera above the mark"),
    "a camera that looks up": (lambda _: None, toml(quaternion=[1, 0, 0, 0]), "a camera above the mark"),
    "an unknown key": (lambda _: None, toml() + "colour = 1\n", "mark.colour"),
    "no camera": (lambda _: None, "", "a.toml: expected"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_wrong_table_or_camera_is_one_sentence(name: str, tmp_path: Path) -> None:
    change, text, said = BAD[name]
    columns = seen(two_runs())
    change(columns)
    with pytest.raises(UserError, match=said) as raised:
        tracks.read(beside(tmp_path, columns, text))
    assert "\n" not in str(raised.value)


def test_a_table_of_corners_without_its_camera_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"Expected the camera of the corners .* in .*a\.toml"):
        tracks.read(saved(seen(two_runs()), tmp_path / "a.csv"))
