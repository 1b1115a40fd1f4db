"""The libraries of each lock, beside its system's NumPy, really track a mark; on demand, for it downloads 100 MB."""

from __future__ import annotations

import json
import os
import subprocess
import venv
from pathlib import Path

import cv2
import numpy as np
import pytest

from station.app.deploy.locks import read_lock
from station.app.deploy.systems import SYSTEMS, System

pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(
        "deploy" not in os.environ.get("REPOSE_REQUIRE", "").split(","),
        reason="downloads 100 MB: ask for it with REPOSE_REQUIRE=deploy",
    ),
]
CHECKOUT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("system", SYSTEMS.values(), ids=lambda system: system.codename)
def test_the_tracker_works_with_the_systems_numpy(system: System, tmp_path: Path):
    """The test runs on this machine's processor and Python, at the versions that the Pi gets."""
    venv.create(tmp_path / "venv", with_pip=True)
    python = str(tmp_path / "venv/bin/python")
    pins = [f"{pin.name}=={pin.version}" for pin in read_lock(system.lock)]
    wanted = [*pins, f"numpy=={system.numpy}"]
    subprocess.run([python, "-m", "pip", "install", "--quiet", "--only-binary", ":all:", *wanted], check=True)
    image = np.full((600, 600), 200, np.uint8)
    image[270:332, 265:327] = 30
    cv2.imwrite(str(tmp_path / "mark.png"), cv2.GaussianBlur(image, (0, 0), 0.8))
    words = [python, "-W", "error", "-m", "pi_agent", "track", str(tmp_path / "mark.png"), "--json"]
    done = subprocess.run(words, capture_output=True, text=True, check=False, cwd=CHECKOUT)
    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout.splitlines()[0])
    assert seen["found"], seen
    corners = np.reshape(seen["corners_px"], (4, 2))
    assert corners.mean(axis=0) == pytest.approx([295.5, 300.5], abs=0.02)
