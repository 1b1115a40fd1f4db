"""The disk of the recordings is full, or turns read-only. It is one of our own, which needs root."""

from __future__ import annotations

import contextlib
import subprocess
import time
from pathlib import Path
from random import Random

from tests.faults.lab import Lab
from tests.faults.row import Row


def full(lab: Lab, _random: Random) -> None:
    """Another program fills it."""
    filler = lab.disk / "filler"
    with contextlib.suppress(OSError), filler.open("wb", buffering=0) as file:
        while file.write(bytes(1 << 20)) == 1 << 20:
            pass
    time.sleep(10.0)
    filler.unlink()


def read_only(lab: Lab, _random: Random) -> None:
    """The kernel finds an error on it and takes no more writes (errors=remount-ro); it is mended and comes back."""
    found = subprocess.run(["findmnt", "-no", "SOURCE", str(lab.disk)], check=True, capture_output=True, text=True)
    trigger = Path("/sys/fs/ext4") / Path(found.stdout.strip()).name / "trigger_fs_error"
    trigger.write_text("a fault\n", encoding="ascii")
    time.sleep(10.0)
    lab.end("station")
    lab.mend()


ROWS = (
    Row("disk full", full, ends=True, network=True),
    Row("disk turns read-only", read_only, ends=True, network=True, ext4=True),
)
