"""Somebody else on the bus: nonsense on every topic and service, a flood, and a second rig of the same name."""

from __future__ import annotations

import contextlib
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


def beside(programs: tuple[tuple[str, ...], ...], lab: Lab, _random: Random) -> None:
    """Programs of a rig of the same id, with addresses of its own, for fifteen seconds."""
    other = lab.folder / "other.toml"
    text = lab.rig.read_text(encoding="utf-8")
    if lab.network is not None:
        for name in ("camera", "arm", "twin", "station"):
            text = text.replace(lab.network.address(name) + ":", lab.network.address("stranger") + ":")
    other.write_text(text, encoding="utf-8")
    inside = lab.network.inside("stranger") if lab.network is not None else []
    with contextlib.ExitStack() as stack:
        for program in programs:
            words = [*inside, sys.executable, "-m", *program, "--rig", str(other)]
            process = subprocess.Popen(words, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.STDOUT)
            stack.callback(process.wait, 20.0)
            stack.callback(process.terminate)
        time.sleep(15.0)


CAMERA = (("pi_agent", "run"),)
WHOLE = (("station", "twin"), ("station", "arm"), *CAMERA)
ROWS = (
    Row("nonsense on every topic, 10 s", partial(send, "malformed"), blind=False),
    Row("a flood of log lines, 10 s", partial(send, "flood"), blind=False),
    Row("messages of another version, 10 s", partial(send, "version"), blind=False),
    Row("a second camera agent of the same id", partial(beside, CAMERA), blind=False, network=True),
    Row("a second rig of the same id", partial(beside, WHOLE), blind=False, network=True),
)
