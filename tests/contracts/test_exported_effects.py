"""An exported file carries each effect as it is: the same bits at the same states, without this package.

It runs over every effect that is found, over one of a user's own, and over every kind of term without a name.
"""

from __future__ import annotations

import tomllib
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from station.export import export_model
from station.export.exported import ExportedFile
from station.export.from_model import NamedModel
from station.physics.catalogue import catalogue
from station.physics.contact import Contact, View
from station.physics.effect import HOOKS, Effect
from station.physics.model import Model, Term, model_of_table
from station.physics.parameter import Parameter
from tests.contracts.effect_states import contacts, views
from tests.readmes.blocks import blocks
from tests.unit.export.apart import apart

SMOOTH = """
[friction]
mu_s = 0.36
[[smooth]]
covariate = "run"
at = ["onset", "sliding"]
powers = { middle = 75.0, spread = 135.0 }
coefficients = [0.02, -0.01]
[[smooth]]
covariate = "direction"
at = ["onset"]
harmonics = ["cos 1", "sin 1"]
coefficients = [0.03, 0.1]
[[smooth]]
covariate = "run"
at = ["sliding"]
swings = { low = 0.0, width = 149.0, often = 2.5 }
coefficients = [0.1, 0.05]
[[smooth]]
covariate = "last slide"
at = ["onset"]
powers = { middle = 0.0, spread = 1.0 }
coefficients = [0.1]
runs = [1, 2, 3]
values = [0.5, -0.2, 0.1]
[[smooth]]
covariate = "position"
push = "field"
coefficients = [0.1, 0.2, 0.3, 0.1, 0.2, 0.3, 0.1, 0.2, 0.3, 0.1, 0.2, 0.3, 0.1, 0.2]
"""
SCRIPT = """
import numpy as np
import all_numpy as file

state = np.load("state.npz")
contact = file.Contact(**{name[8:]: state[name] for name in state if name.startswith("contact_")})
seen = {name[5:]: state[name] for name in state if name.startswith("view_")}
view = file.View(**{name: value if value.ndim else value.item() for name, value in seen.items()})
found = {}
for number, term in enumerate(file.MODEL.terms):
    for hook in file.HOOKS:
        given = {"seen": (view,), "delay_s": ()}.get(hook, (contact,))
        value = getattr(term.effect, hook)(*given, term.values)
        if value is not None:
            found[f"{number} {hook}"] = value
np.savez("found.npz", **found)
"""
SAME_NAMES = '''
"""An effect whose class and whose constant are called like those of others."""
import numpy as np
from station.physics.effect import Effect as Base
from station.physics.parameter import Parameter

REFERENCE_N = 3.0

class Wear(Base):
    """Friction by the mass."""
    id, title, law, source = "my_wear", "my wear", "1 + a m", "me"
    layer, family, separated_by = "contact", "load", "masses"
    parameters = (Parameter(name="a", unit="1/kg", low=0.0, high=1.0, typical=0.1),)

    def friction(self, contact, values):
        return 1.0 + values["a"] * contact.mass_kg / REFERENCE_N
'''


def all_terms(folder: Path) -> tuple[Term, ...]:
    """Each effect at a plain size with its shapes off their starts, ours and two of a user's, and the smooth terms."""
    (humidity,) = [block.text for block in blocks("python") if block.readme == "station/physics/README.md"]
    (folder / "humidity.py").write_text(humidity, encoding="utf-8")
    (folder / "my_wear.py").write_text(SAME_NAMES, encoding="utf-8")
    named = tuple(Term(effect, off_null(effect)) for effect in catalogue([folder]).values())
    return (*named, *model_of_table(tomllib.loads(SMOOTH), {}).terms)


def off_null(effect: Effect) -> dict[str, float]:
    """Values at which the whole law acts."""
    return {one.name: one.clipped(0.9 * one.starts[-1] if one.is_shape else _some(one)) for one in effect.parameters}


def _some(one: Parameter) -> float:
    return one.neutral + 0.5 * one.typical


@pytest.fixture(scope="module")
def terms(tmp_path_factory: pytest.TempPathFactory) -> tuple[Term, ...]:
    return all_terms(tmp_path_factory.mktemp("effects"))


@pytest.fixture(scope="module")
def exported(terms: tuple[Term, ...]) -> ExportedFile:
    (file,) = export_model(NamedModel("all", Model(mu_s=0.36, scatter=0.1, terms=terms)), "numpy")
    return file


def test_every_method_of_every_effect_gives_the_same_bits(
    terms: tuple[Term, ...], exported: ExportedFile, tmp_path: Path
):
    contact, view = contacts(200), views(200)
    state = {f"contact_{one.name}": getattr(contact, one.name) for one in fields(Contact)}
    state |= {f"view_{one.name}": getattr(view, one.name) for one in fields(View)}
    np.savez(tmp_path / "state.npz", **state)
    apart(tmp_path, [exported], SCRIPT)
    found = np.load(tmp_path / "found.npz")
    for number, term in enumerate(terms):
        for hook in HOOKS:
            given: dict[str, tuple[Any, ...]] = {"seen": (view,), "delay_s": ()}
            ours = getattr(term.effect, hook)(*given.get(hook, (contact,)), term.values)
            if ours is not None:
                assert np.array_equal(found[f"{number} {hook}"], ours), (term.effect.id, hook)


def test_nothing_in_the_file_speaks_of_this_package_but_the_lines_that_name_its_parts(exported: ExportedFile):
    code = [line for line in exported.text.splitlines() if not line.lstrip().startswith("#")]
    assert not [line for line in code if "import station" in line or "from station" in line or "shared." in line]
    assert "class Wear_of_my_wear(Effect)" in exported.text
    assert "REFERENCE_N_of_" in exported.text


def test_what_nothing_asks_for_stays_here(exported: ExportedFile):
    for left in ("def why_untestable", "separated_by: ClassVar", "def idle", "def derived", "UserError", "_of_table"):
        assert left not in exported.text
