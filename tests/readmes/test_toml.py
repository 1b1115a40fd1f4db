"""Every block of TOML in every page is read by the program that it is written for; a table that none takes fails."""

from __future__ import annotations

import shutil
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from shared.clock import SimulatedClock
from shared.config import parse
from shared.memory_bus import MemoryBus
from shared.rig import load_rig
from station.__main__ import main as station
from station.angles.instruments import Instruments
from station.arm.drivers.ros2 import Ros2Options
from station.arm.tilter import settled_model, settled_stage
from station.rig.arm_settings import ArmSettings
from station.simulators.scene.keys import Keys, keys_beside
from tests.readmes.blocks import ROOT, Block, blocks
from tests.readmes.reader import furnish
from tests.system.processes import rig_file

PHYSICS = "station/physics/README.md"


def _sources(text: str) -> None:
    """Checks that each table in the example rig file is a source that could be opened."""
    rig = Path(shutil.copy(ROOT / "deploy" / "rig.example.toml", "example.toml"))
    rig.write_text(rig.read_text(encoding="utf-8") + text, encoding="utf-8")
    clock = SimulatedClock()
    instruments = Instruments(MemoryBus(clock), load_rig(rig).angles, clock=clock, threaded=False)
    instruments.close()
    assert set(tomllib.loads(text)["angles"]) < set(instruments.names)


def _model(text: str) -> None:
    Path("model.toml").write_text(text, encoding="utf-8")
    assert station(["simulate", "session.mcap", "--model", "model.toml", "--out", "again.mcap"]) == 0


def _smooth(text: str) -> None:
    """It stands beside the tables of the block before, as the page says."""
    _model(next(block.text for block in blocks("toml") if block.readme == PHYSICS) + text)


def _own_effect(text: str) -> None:
    """The folder of effects that it names holds the one that the page shows."""
    (effect,) = [block.text for block in blocks("python") if block.readme == PHYSICS]
    (named,) = tomllib.loads(text)["physics"]["effects"]
    Path(named).mkdir()
    Path(named, "humidity.py").write_text(effect, encoding="utf-8")
    rig = rig_file(Path.cwd(), name="own", extra=text)
    assert station(["plan", "--separate", "humidity", "--rig", str(rig)]) == 0


def test_the_first_pages_effect_is_planned_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (effect,) = [block.text for block in blocks("python") if block.readme == "README.md" and "Effect" in block.text]
    monkeypatch.chdir(tmp_path)
    Path("mine").mkdir()
    Path("mine", "humidity.py").write_text(effect, encoding="utf-8")
    rig = rig_file(tmp_path, name="own", extra='[physics]\neffects = ["mine"]\n')
    assert station(["plan", "--separate", "humidity", "--rig", str(rig)]) == 0


def _own_importer(text: str) -> None:
    """The folder that it names, `mine`, holds the importer that the page shows."""
    rig = rig_file(Path.cwd(), name="own", extra=text)
    assert station(["import", "our-slope", "slope.log", "--rig", str(rig), "--out", "ours.mcap"]) == 0


def _notified(text: str) -> None:
    """It names a url and a command."""
    told = load_rig(rig_file(Path.cwd(), name="told", extra=text)).notify
    assert told.url
    assert "{text}" in told.command


def _scene(text: str) -> None:
    """The keys name what a scene calls its bodies."""
    Path("scene.toml").write_text(text, encoding="utf-8")
    assert keys_beside(Path("scene.xml")) == Keys()


def _ros2(text: str) -> None:
    """The rig has a bus away from ROS 2's port, and an arm and driver that take what they are told."""
    Path("ros2.toml").write_text('id = "lab"\n' + text, encoding="utf-8")
    rig = load_rig(Path("ros2.toml"))
    settings = parse(ArmSettings, rig.arm)
    router = parse(Ros2Options, settings.options).router
    assert router.endswith(":7447")
    assert not any(address.endswith(":7447") for address in rig.bus.peers("observer"))
    assert settled_stage(settings, settled_model(settings)).model.name == "ur5e"


READERS: dict[str, Callable[[str], None]] = {
    "block": _scene,
    "angles": _sources,
    "friction": _model,
    "smooth": _smooth,
    "physics": _own_effect,
    "plugins": _own_importer,
    "notify": _notified,
    "bus": _ros2,
}
"""The readers of a block, by its first table."""


@pytest.mark.parametrize("block", blocks("toml"), ids=lambda block: f"{block.readme}-{next(iter(_tables(block)))}")
def test_its_program_reads_it(block: Block, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(furnish(tmp_path / "here"))
    first = next(iter(_tables(block)))
    assert first in READERS, f"no test knows the reader of [{first}] in {block.readme}"
    READERS[first](block.text)


def _tables(block: Block) -> list[str]:
    return list(tomllib.loads(block.text))
