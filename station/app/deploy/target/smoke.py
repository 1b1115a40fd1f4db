"""Tries a release before it is switched to: whether it imports, with the libraries that it is meant to use."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

from .account import identity_of
from .paths import Refused

_TRIAL = """
import importlib, json, sys
import cv2, numpy, zenoh
from importlib.metadata import version
from pathlib import Path
from shared.rig import load_rig
import pi_agent.agent, pi_agent.run_command
rig = load_rig(Path(sys.argv[1]))
importlib.import_module("pi_agent.cameras." + rig.camera.driver)
found = {"numpy": numpy.__version__, "opencv": cv2.__version__, "zenoh": version("eclipse-zenoh")}
found["numpy_file"] = numpy.__file__
try:
    import picamera2
    found["picamera2"] = picamera2.__file__
except ImportError as error:
    found["picamera2_missing"] = str(error)
image = numpy.zeros((64, 64), numpy.uint8)
cv2.cornerSubPix(image, numpy.full((1, 1, 2), 32, numpy.float32), (5, 5), (-1, -1), (3, 3, 0.1))
print(json.dumps(found))
"""


def try_release(release: Path, *, own_numpy: bool, account: str) -> dict[str, Any]:
    """Imports the agent as the agent's account; gives the versions found.

    Raises:
        Refused: if it does not import, or another NumPy than the system's would be used (unless the lock has its own).
    """
    agent = identity_of(account)
    environment = {"PYTHONPATH": str(release), "PATH": os.environ.get("PATH", ""), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [str(release / "venv/bin/python"), "-c", _TRIAL, str(release / "rig.toml")],
        cwd=release,
        env={**environment, "HOME": "/nonexistent"},
        capture_output=True,
        text=True,
        check=False,
        user=agent.user,
        group=agent.group,
        extra_groups=agent.groups,
    )
    if done.returncode != 0:
        reason = (done.stderr.strip().splitlines() or [f"status {done.returncode}"])[-1]
        raise Refused(f"The new release does not start on the target ({reason}); what ran before was not touched")
    found: dict[str, Any] = json.loads(done.stdout.strip().splitlines()[-1])
    venvs = release.parent.parent / "venvs"
    if not own_numpy and Path(found["numpy_file"]).resolve().is_relative_to(venvs.resolve()):
        raise Refused("Expected the system's NumPy, got one from the wheels: picamera2 would break; check the lock")
    return found
