"""A folder as the reader of a page has it: a rig file, recordings and a table under the names that the pages use."""

from __future__ import annotations

import shutil
from contextlib import chdir
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from station.recording.tables import write_samples
from tests.concealed.design import Design, Nuisance, Setting
from tests.concealed.files import rig_toml, write_session
from tests.concealed.session import SessionRecord, run_session
from tests.concealed.world import NULL
from tests.readmes.blocks import ROOT, blocks
from tests.system.processes import rig_file
from tests.unit.arm.urdf.written_urdf import STAGE, written
from tests.unit.diagnosis.recorded import GOLDEN
from tests.unit.diagnosis.tables import samples
from tests.unit.recording.test_importers import made_up
from tests.unit.simulators.point_block import SCENE

IMPORTERS = "station/recording/importers/README.md"
NOISE_M = "2e-5"
"""The noise of places in the tables that the page writes."""


def furnish(folder: Path) -> Path:
    """Makes the folder and gives it."""
    folder.mkdir()
    (folder / "deploy").symlink_to(ROOT / "deploy")
    rig_file(folder, name="rig")
    made_up(folder / "tosses.parquet")
    (folder / "model.toml").write_text("[friction]\nmu_s = 0.36\n", encoding="utf-8")
    shutil.copy(GOLDEN, folder / "session.mcap")
    (folder / "recordings").mkdir()
    shutil.copy(GOLDEN, folder / "recordings")
    write_samples(samples(grain=0.2), folder / "samples.csv")
    write_samples(samples(seed=4), folder / "simulated.csv")
    (folder / "my_sim.py").write_text(_own_simulator(), encoding="utf-8")
    (folder / "scene.xml").write_text(SCENE.format(mu=0.35).replace("cube", "block"), encoding="utf-8")
    written(folder, STAGE)
    _write_tracks(folder)
    _write_plugins(folder / "mine")
    return folder


def _own_simulator() -> str:
    """The simulator that its page shows, and a second function in the same file."""
    (text,) = [block.text for block in blocks("python") if block.readme == "station/simulators/yours/README.md"]
    return f"{text}\n\nother = simulate\n"


def _write_tracks(folder: Path) -> None:
    """The tables of tracks that the importers' page writes, and what stands beside them."""
    for name, text in tracks_of_the_page().items():
        (folder / name).write_text(text, encoding="utf-8")


def _write_plugins(folder: Path) -> None:
    """The importer that its page shows, with a file for it, and the simulator that its page shows."""
    (text,) = [block.text for block in blocks("python") if block.readme == IMPORTERS and "our-slope" in block.text]
    for kind, name, file in (("importers", "ours.py", text), ("simulators", "my_sim.py", _own_simulator())):
        (folder / kind).mkdir(parents=True)
        (folder / kind / name).write_text(file, encoding="utf-8")
    slide = "".join(f"{10 * step} {0.05 * step * step}\n" for step in range(40))
    (folder.parent / "slope.log").write_text(f"tilt 24\n{slide}tilt 25\n{slide}", encoding="utf-8")


@cache
def tracks_of_the_page(noise_m: str = NOISE_M) -> dict[str, str]:
    """The files that the importers' page writes, by their names; with another noise of its places, if one is given."""
    with TemporaryDirectory() as folder, chdir(folder):
        for block in blocks("python"):
            if block.readme == IMPORTERS:
                exec(block.text.replace(f"noise_m={NOISE_M}", f"noise_m={noise_m}"), {})
        return {path.name: path.read_text(encoding="utf-8") for path in Path(folder).iterdir()}


def write_twenty_runs(path: Path) -> None:
    """A recording hardly longer than the shortest that `station diagnose` examines: at least twenty of its runs count.

    Nothing is wrong in it, so it takes seconds. One of the first twenty runs begins at the foam.
    """
    setting, session = _twenty_runs()
    rig = rig_toml(setting, mu_guess=0.35, scatter_guess=0.1)
    write_session(session, path, rig=rig, rng=np.random.default_rng(1))


@cache
def _twenty_runs() -> tuple[Setting, SessionRecord]:
    design = Design(runs=22, adapt_after=3, wide_deg=36.0, wide_steps=18, handled_every=5, yaw_varies=True)
    setting = Setting(design=design, nuisance=Nuisance(scatter=0.03, noise_px=0.1), world=NULL)
    return setting, run_session(setting, np.random.default_rng(1))
