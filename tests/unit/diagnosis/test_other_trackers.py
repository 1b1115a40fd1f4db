"""A block that another tracker follows in space tells its heading on any face, and its track's noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from shared.geometry import Array
from station.diagnosis.observations.plate import Times
from station.diagnosis.observations.track_noise import track_noise
from station.diagnosis.observations.tracks import _heading, run_tracks  # pyright: ignore[reportPrivateUsage]
from station.signals.tracks import PoseTrack
from tests.unit.simulators.test_planar_session import tossed

FACES = {
    "sole": Rotation.identity(),
    "back": Rotation.from_euler("x", np.pi),
    "side": Rotation.from_euler("x", np.pi / 2),
    "front": Rotation.from_euler("y", np.pi / 2),
    "rear": Rotation.from_euler("y", -np.pi / 2),
}


@pytest.mark.parametrize("face", FACES)
def test_the_heading_turns_with_the_block_on_every_face(face: str) -> None:
    wanted = np.linspace(0.0, 1.5, 40)
    wobble = Rotation.from_rotvec(np.random.default_rng(1).normal(0.0, 1e-3, (40, 3)))
    turn = (wobble * Rotation.from_euler("z", wanted[:, None]) * FACES[face]).as_matrix()
    heading = np.unwrap(_heading(turn))
    assert heading - heading[0] == pytest.approx(wanted, abs=0.01)


def slide(noise_m: float, *, frames: int = 400, smoothed: int = 1) -> tuple[Array, Times]:
    """Places (n, 2) of a block that slows down evenly, with noise that lasts for so many frames; times (n,)."""
    rng, seconds = np.random.default_rng(3), np.arange(frames) / 150.0
    noise = rng.normal(0.0, noise_m * np.sqrt(smoothed), (frames + smoothed - 1, 2))
    kernel = np.ones(smoothed) / smoothed
    noise = np.column_stack([np.convolve(column, kernel, mode="valid") for column in noise.T])
    way = 1.5 * seconds - 0.25 * seconds**2
    return np.column_stack([way, 0.5 * way]) + noise, np.asarray(np.round(seconds * 1e9), dtype=np.int64)


@pytest.mark.parametrize(("noise_m", "smoothed"), [(2e-5, 1), (4e-4, 1), (1e-4, 3)])
def test_a_tracks_noise_is_read_from_its_slides(noise_m: float, smoothed: int) -> None:
    place, time_ns = slide(noise_m, smoothed=smoothed)
    found = track_noise(time_ns, place[:, 0], place, np.ones(len(place), dtype=bool))
    assert found == pytest.approx(noise_m, rel=0.15)


def test_impacts_and_gaps_and_rest_tell_nothing_of_the_noise() -> None:
    place, time_ns = slide(5e-5)
    flat = np.ones(len(place), dtype=bool)
    place[100:110] += 0.02
    flat[100:110] = False
    time_ns[200:] += 3_000_000_000
    place[200:] += 0.5
    assert track_noise(time_ns, place[:, 0], place, flat) == pytest.approx(5e-5, rel=0.2)
    assert track_noise(time_ns, place[:, 0], np.zeros_like(place), flat) is None
    assert track_noise(time_ns[:5], place[:5, 0], place[:5], flat[:5]) is None


def test_what_the_track_says_of_its_noise_is_believed() -> None:
    recorded = tossed(0.2)
    block = recorded.block
    said = PoseTrack(
        time_ns=block.time_ns,
        position_m=block.position_m,
        quaternion=block.quaternion,
        sigma_m=np.full(len(block), 3e-4),
        sigma_rad=np.full(len(block), 2e-3),
        found=block.found,
    )
    (told,) = run_tracks(replace(recorded, block=said))
    (read,) = run_tracks(recorded)
    assert (told.sigma_m, told.sigma_rad) == (3e-4, 2e-3)
    assert read.sigma_m == pytest.approx(1e-4), "too short to tell"
