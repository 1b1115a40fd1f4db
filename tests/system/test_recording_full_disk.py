"""A disk that is really full: a small file system of its own, in a private namespace of this user."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from shared import foxglove
from station.recording.provenance import Provenance
from station.recording.reader import open_recording
from station.recording.writer import Recording
from tests.patience import PATIENCE_S

pytestmark = pytest.mark.system
ROOT = Path(__file__).parents[2]
SIZE_MB = 12
_MOUNT = (
    f'mount -t tmpfs -o size={SIZE_MB}m tmpfs "$1" && "$2" -m tests.system.test_recording_full_disk "$1/a.mcap" "$3"'
)


def in_a_small_disk(folder: Path, saved: Path) -> subprocess.CompletedProcess[str]:
    (folder / "disk").mkdir()
    arguments = [str(folder / "disk"), sys.executable, str(saved)]
    command = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c", _MOUNT, "sh", *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=PATIENCE_S)


@pytest.fixture(scope="module", autouse=True)
def _namespaces() -> None:
    probe = ["unshare", "--user", "--map-root-user", "--mount", "true"]
    if shutil.which("unshare") is None or subprocess.run(probe, capture_output=True, check=False).returncode:
        pytest.skip("this machine does not allow private mounts")


def test_the_recording_is_closed_and_valid(tmp_path: Path) -> None:
    done = in_a_small_disk(tmp_path, tmp_path / "saved.mcap")
    assert done.returncode == 0, done.stderr
    sentence, taken = done.stdout.splitlines()
    assert "the disk is full" in sentence
    found = sum(1 for _ in open_recording(tmp_path / "saved.mcap").messages())
    assert found == int(taken) > 10


def fill(path: Path, saved: Path) -> None:
    """Records incompressible frames until the disk is full, and copies the outcome to where it can be looked at."""
    frame = np.random.default_rng(1).bytes(50_000)
    provenance = Provenance(rig_id="full", started_ns=1)
    recording = Recording(path, provenance=provenance, min_free_bytes=0)
    taken = 0
    while not recording.stopped:
        recording.write_message("camera/image", foxglove.CompressedImage(data=frame), receive_ns=1_000_000 * taken + 1)
        taken += 1
    print(recording.stopped)
    print(taken)
    shutil.copy(path, saved)


if __name__ == "__main__":
    fill(Path(sys.argv[1]), Path(sys.argv[2]))
