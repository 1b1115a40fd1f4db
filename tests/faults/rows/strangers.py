"""Somebody else on the bus: nonsense on every topic and service, a flood, and a second rig of the same name."""

from __future__ import annotations

import subprocess
import sys
import time
from functools import partial
from random import Random

from tests.faults.lab import Lab
from tests.faults.row import Row
from tests.system.processes import ROOT


def send(what: str, lab: Lab, _random: Random) -> None:
    """For ten seconds, at every port."""
    inside = lab.network.inside("stranger") if lab.network is not None else []
    words = ["-m", "tests.faults.nuisance", str(lab.rig), what, "10"]
    subprocess.run([*inside, sys.executable, *words], cwd=ROOT, check=True, timeout=60)


def second_rig(lab: Lab, _random: Random) -> None:
    """A camera agent of the same id, with addresses of its own, for ten seconds."""
    other = lab.folder / "other.toml"
    text = lab.rig.read_text(encoding="utf-8")
    if lab.network is not None:
        text = text.replace(lab.network.address("camera") + ":", lab.network.address("stranger") + ":")
    other.write_text(text, encoding="utf-8")
    inside = lab.network.inside("stranger") if lab.network is not None else []
    words = ["-m", "pi_agent", "run", "--rig", str(other)]
    process = subprocess.Popen(
        [*inside, sys.executable, *words], cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.STDOUT
    )
    time.sleep(12.0)
    process.terminate()
    process.wait(20.0)


ROWS = (
    Row("nonsense on every topic, 10 s", partial(send, "malformed"), blind=False),
    Row("a flood of log lines, 10 s", partial(send, "flood"), blind=False),
    Row("messages of another version, 10 s", partial(send, "version"), blind=False),
    Row("a second camera agent of the same id", second_rig, blind=False, network=True),
)
