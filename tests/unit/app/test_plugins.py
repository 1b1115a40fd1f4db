"""Importers and simulators of the user's own: found by their folder, and each fault of theirs is one sentence."""

from __future__ import annotations

from pathlib import Path

import pytest

from shared.config import Table
from shared.errors import UserError
from station.app.plugins import importer_files, named_in, plugin_folders
from station.recording.importers import importers

SOUND = """
from shared.messages import RunEvent
from station.recording.importers import Imported
from station.recording.provenance import Provenance

NAME, HELP = "ours", "what our laboratory writes"

def read(source, *, onset=None):
    return Imported(provenance=Provenance(rig_id="ours", started_ns=0), messages=events(source))

def events(source):
    for number, word in enumerate(source.read_text().split()):
        yield "session/event", number, RunEvent(stamp_ns=number, phase=word)
        int(word)
"""


def mine(folder: Path, text: str) -> tuple[Path, ...]:
    (folder / "importers").mkdir(exist_ok=True)
    (folder / "importers" / "ours.py").write_text(text, encoding="utf-8")
    (folder / "importers" / "_shared.py").write_text("raise RuntimeError\n", encoding="utf-8")
    return importer_files(plugin_folders(None, [folder]))


def test_an_importer_stands_beside_ours(tmp_path: Path) -> None:
    found = importers(mine(tmp_path, SOUND))
    assert {"ours", "tracks", "cube-tosses"} <= set(found)
    (tmp_path / "a.txt").write_text("1 2", encoding="utf-8")
    assert len(list(found["ours"].read(tmp_path / "a.txt").messages)) == 2


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("NAME, HELP = 'ours', 'x'", "Expected NAME, HELP and a function read in the importer .*ours.py"),
        (
            "x = 1\nimport no_such_thing",
            "ours.py to be imported, but it failed, line 2: ModuleNotFoundError: No module",
        ),
        ("def read(:", "to be imported, but it failed: SyntaxError"),
        (
            SOUND.replace('"ours", "what', '"tracks", "what'),
            "every importer once, but tracks comes again from .*ours.py",
        ),
    ],
)
def test_a_file_that_is_no_importer_is_one_sentence(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=said) as raised:
        importers(mine(tmp_path, text))
    assert "\n" not in str(raised.value)


def test_what_goes_wrong_in_an_importer_names_its_line(tmp_path: Path) -> None:
    own = importers(mine(tmp_path, SOUND))["ours"]
    (tmp_path / "a.txt").write_text("1 two", encoding="utf-8")
    with pytest.raises(UserError, match=r"to give its messages, but it failed, line 14: ValueError: invalid literal"):
        list(own.read(tmp_path / "a.txt").messages)
    with pytest.raises(UserError, match=r"Expected an Imported from read in .*ours.py, got NoneType"):
        importers(mine(tmp_path, SOUND.replace("return Imported", "Imported")))["ours"].read(tmp_path / "a.txt")


def test_a_simulator_is_named_by_its_file(tmp_path: Path) -> None:
    (tmp_path / "simulators").mkdir()
    for name in ("mine.py", "scene.xml", "scene.toml", "_shared.py"):
        (tmp_path / "simulators" / name).touch()
    folders = plugin_folders(None, [tmp_path])
    assert named_in(folders, "mine:other") == f"{tmp_path / 'simulators' / 'mine.py'}:other"
    assert named_in(folders, "scene") == str(tmp_path / "simulators" / "scene.xml")
    assert named_in(folders, "planar") == "planar"
    (tmp_path / "simulators" / "planar.py").touch()
    with pytest.raises(UserError, match=r"another name for the simulator .*planar.py, it is that of one of ours"):
        named_in(folders, "mine")


def test_a_folder_must_be_there_and_be_the_users_own(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"at .*none, but there is no such folder"):
        plugin_folders(None, [tmp_path / "none"])
    with pytest.raises(UserError, match=r"a subfolder 'importers' or 'simulators' at .*, found neither"):
        plugin_folders(None, [tmp_path])
    stranger = Table({"folders": [str(tmp_path)]}, "rig.toml in stranger.mcap", path=("plugins",))
    with pytest.raises(UserError, match=r"no folders outside a rig file on disk"):
        plugin_folders(stranger)
