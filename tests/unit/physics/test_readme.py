"""The README of station/physics tells what is so."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from station.physics import catalogue as module
from station.physics.catalogue import catalogue
from tests.contracts.effect_states import contacts

README = Path(module.__file__).with_name("README.md").read_text(encoding="utf-8")


def test_the_example_is_an_effect(tmp_path: Path) -> None:
    """The example works as it stands, in a folder of its own."""
    (example,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    (tmp_path / "humidity.py").write_text(example, encoding="utf-8")
    effect = catalogue([tmp_path])["humidity"]
    unknown = contacts(3)
    damp = replace(unknown, relative_humidity=np.array([0.3, 0.5, 0.7]))
    np.testing.assert_allclose(effect.friction(damp, {"slope": 0.5}), [0.9, 1.0, 1.1])
    assert np.all(effect.friction(unknown, {"slope": 0.5}) == 1.0)
    assert effect.why_untestable(damp) is None
    assert "no humidity" in str(effect.why_untestable(unknown))


def test_the_table_names_every_effect_with_its_methods_and_parameters() -> None:
    """One row each, nothing missing and nothing left over."""
    rows = re.findall(r"^\| `(\w+)` \| .* \| ([a-z_, ]+) \| (.*) \|$", README, re.MULTILINE)
    known = catalogue()
    assert sorted(name for name, _, _ in rows) == sorted(known)
    for name, methods, parameters in rows:
        assert set(methods.split(", ")) == known[name].acts_through()
        assert all(re.search(rf"\b{one.name}\b", parameters) for one in known[name].parameters)
        assert parameters.count("(s)") == sum(one.is_shape for one in known[name].parameters)
