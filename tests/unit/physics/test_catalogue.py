"""Effects found by being there, and what is said of files that are none."""

from __future__ import annotations

import pickle
import subprocess
import sys
import textwrap
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.config import Table
from shared.errors import UserError
from shared.rig import load_rig
from station.physics.catalogue import catalogue, catalogue_of_table, effect_folders
from station.physics.model import Model, Term, model_of_table
from tests.contracts.effect_states import contacts

GUST = '''
"""A gust of air along x while the block slides."""

import numpy as np

from station.physics.effect import Effect
from station.physics.parameter import Parameter


class Gust(Effect):
    """A steady push along x."""

    id = "gust"
    title = "a gust of air"
    law = "push p along x (p = 0)"
    source = "own measurement 2026"
    layer = "rig"
    family = "level"
    parameters = (Parameter(name="push_m_s2", unit="m/s²", low=-1.0, high=1.0, typical=0.1),)
    confounded_with = ("platform_level",)
    separated_by = "the fan switched off in every second run"

    def push(self, contact, values):
        """Along x."""
        return np.outer(np.ones(len(contact)), [values["push_m_s2"], 0.0, 0.0])
'''


def written(folder: Path, text: str, name: str = "gust.py") -> Path:
    """A folder with one file."""
    (folder / name).write_text(textwrap.dedent(text))
    return folder


def test_a_file_in_a_folder_is_an_effect(tmp_path: Path) -> None:
    """Without touching the package."""
    known = catalogue([written(tmp_path, GUST)])
    model = model_of_table({"friction": {"mu_s": 0.4}, "effects": {"gust": {"push_m_s2": 0.25}}}, known)
    assert set(known) - set(catalogue()) == {"gust"}
    np.testing.assert_array_equal(model.push(contacts(3)), [[0.25, 0, 0]] * 3)
    assert isinstance(model, Model)


def test_an_effect_travels_to_another_process(tmp_path: Path) -> None:
    """The other process has not read the folder: recordings are diagnosed side by side."""
    known = catalogue([written(tmp_path, GUST)])
    model = Model(
        mu_s=0.4, terms=(Term(known["gust"], {"push_m_s2": 0.25}), Term(known["wear"], {"fall": 0.1, "runs": 9.0}))
    )
    (tmp_path / "model.pickle").write_bytes(pickle.dumps(model))
    code = "import pickle, sys; sys.stdout.buffer.write(pickle.dumps(pickle.load(open(sys.argv[1], 'rb'))))"
    there = subprocess.run([sys.executable, "-c", code, tmp_path / "model.pickle"], check=True, capture_output=True)
    back = pickle.loads(there.stdout)
    assert back == model
    assert [term.effect.title for term in back.terms] == ["a gust of air", known["wear"].title]


def test_an_effect_that_has_other_parameters_keeps_them_there(tmp_path: Path) -> None:
    gust = catalogue([written(tmp_path, GUST)])["gust"]
    wider = gust.having(id="_gust", parameters=tuple(replace(one, typical=2 * one.typical) for one in gust.parameters))
    back = pickle.loads(pickle.dumps(wider))
    assert (back.id, back.parameters) == ("_gust", wider.parameters)
    assert (gust.id, gust.parameters) != (back.id, back.parameters)


def test_an_edited_file_is_read_anew(tmp_path: Path) -> None:
    """A notebook edits a file between two calls."""
    assert catalogue([written(tmp_path, GUST)])["gust"].title == "a gust of air"
    again = catalogue([written(tmp_path, GUST.replace("a gust of air", "a strong gust of air"))])
    assert again["gust"].title == "a strong gust of air"


def test_a_folder_may_hold_other_files_and_an_init(tmp_path: Path) -> None:
    """Only its modules are effects."""
    written(tmp_path, GUST)
    written(tmp_path, '"""Ours."""', "__init__.py")
    written(tmp_path, "not Python at all", "notes.txt")
    assert "gust" in catalogue([tmp_path])


def test_two_folders_may_use_one_file_name(tmp_path: Path) -> None:
    """Their effects differ by id, not by file."""
    first, second = tmp_path / "a", tmp_path / "b"
    first.mkdir()
    second.mkdir()
    known = catalogue([written(first, GUST), written(second, GUST.replace('"gust"', '"draught"'))])
    assert {"gust", "draught"} <= set(known)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("class Gust(:", "importing it failed"),
        ("import nothing_of_this_name", "importing it failed: No module named 'nothing_of_this_name'"),
        ("1 / 0", "importing it failed: division by zero"),
        ("x = 1", "Expected one subclass of Effect in .*gust.py, found 0"),
        (GUST + "\n\nclass Other(Effect):\n    pass\n", "found 2"),
        (GUST.replace('"gust"', '"wear"'), "Expected every effect once, but wear comes again"),
        (GUST.replace('"gust"', '"a gust"'), "an `id` of letters"),
        (
            GUST.replace('    source = "own measurement 2026"\n', ""),
            "Expected in the effect Gust of .*gust.py a text for `source`, got None",
        ),
        (
            GUST.replace('separated_by = "the fan switched off in every second run"', 'separated_by = ""'),
            "separated_by",
        ),
        (
            GUST.replace('layer = "rig"', 'layer = "wind"'),
            "one of contact, rig, camera, numerics for `layer`, got 'wind'",
        ),
        (GUST.replace('family = "level"', 'family = "wind"'), "one of speed law, .* for `family`, got 'wind'"),
        (GUST.replace("typical=0.1", "typical=0.1, null=None, starts=(0.1,)"), "a parameter with a null value"),
        (GUST.replace("low=-1.0", "low=2.0"), "expected low < high"),
        (GUST.replace("def push", "def pull"), "one of the methods friction, push, .*, got none of them"),
        (GUST.replace('"platform_level",', '"wind",'), "confounded_with of gust, got wind"),
        (GUST.replace("push_m_s2", "push").replace("Parameter(name", "1, Parameter(name"), "a tuple of Parameter"),
    ],
)
def test_a_broken_file_gives_one_sentence(tmp_path: Path, text: str, said: str) -> None:
    """The sentence says what was expected, what came, and in which file."""
    with pytest.raises(UserError, match=said) as raised:
        catalogue([written(tmp_path, text)])
    assert "\n" not in str(raised.value)
    assert "Traceback" not in str(raised.value)


def rig_file(folder: Path, physics: str) -> Path:
    """A rig file with a table [physics]."""
    return written(folder, f'id = "bench"\n[physics]\n{physics}\n', "rig.toml") / "rig.toml"


def test_a_rig_file_names_folders_beside_itself(tmp_path: Path) -> None:
    """Wherever the user stands."""
    (tmp_path / "ours").mkdir()
    written(tmp_path / "ours", GUST)
    rig = load_rig(rig_file(tmp_path, 'effects = ["ours"]'))
    assert effect_folders(rig.physics) == (tmp_path / "ours",)
    assert set(catalogue_of_table(rig.physics)) - set(catalogue()) == {"gust"}


def test_only_a_rig_file_on_disk_can_name_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A rig inside a recording was written by a stranger, and importing an effect runs it."""
    monkeypatch.chdir(tmp_path)
    table = Table({"effects": ["ours"]}, "session.mcap (rig.toml)")
    with pytest.raises(UserError, match="no folders outside a rig file on disk"):
        effect_folders(table)


def test_a_rig_file_without_physics_has_our_effects(tmp_path: Path) -> None:
    """Nothing has to be set."""
    rig = load_rig(written(tmp_path, 'id = "bench"', "rig.toml") / "rig.toml")
    assert set(catalogue_of_table(rig.physics)) == set(catalogue())


@pytest.mark.parametrize("physics", ['effects = "ours"', "folders = []"])
def test_a_wrong_rig_file_is_named_with_its_line(tmp_path: Path, physics: str) -> None:
    """The line is told as everywhere in the rig file."""
    rig = load_rig(rig_file(tmp_path, physics))
    with pytest.raises(UserError, match=r"rig.toml, line 3: expected .* for 'physics\."):
        catalogue_of_table(rig.physics)


def test_a_missing_folder_is_named_with_its_setting(tmp_path: Path) -> None:
    """The rig file is where to look."""
    with pytest.raises(UserError, match=r"nowhere \(physics.effects in the rig file\)"):
        catalogue([tmp_path / "nowhere"])


def test_the_catalogue_cannot_be_changed() -> None:
    """It is shared by everyone who asks."""
    with pytest.raises(TypeError):
        catalogue()["wear"] = None  # pyright: ignore[reportIndexIssue]: that is the point
