"""Code that is cut out of modules with what it needs: names, branches, and what is refused."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from shared.errors import UserError
from station.export.carry import carry

OTHER = """
from math import pi as half_turn

LIMIT, _STEP = 2.0, 3.0
\"\"\"Two numbers.\"\"\"

def scaled(value, step=_STEP):
    LIMIT = 5.0
    return value * step * LIMIT

class Unused:
    pass
"""
MODULE = '''
import math
try:
    from math import cbrt as root
except ImportError:
    def root(value):
        return value ** (1 / 3)
from station.other import LIMIT as MOST, scaled

_STEP = 0.5
"""Called like the other module's."""

class Thing:
    """Has methods, of which some are asked for."""

    kept: int = 1

    def asked(self, µ):  # a name of two bytes before others on its line
        µ = µ + _STEP; return MOST + scaled(µ) + _STEP + self._inner() + sum(_STEP for _STEP in (1, 2))

    def _inner(self):
        return root(8.0) + math.pi

    def by_word(self):
        return 7

    def not_asked(self):
        return nothing_of_this()

def ask(thing):
    return thing.asked(1.0) + getattr(thing, "by_word")()
'''


@pytest.fixture
def module(tmp_path: Path) -> Iterator[ModuleType]:
    """Two modules that look like ours."""
    loaded = [_load(tmp_path / f"{name}.py", f"station.{name}", text) for name, text in _TEXTS.items()]
    yield loaded[-1]
    for one in loaded:
        del sys.modules[one.__name__]


_TEXTS = {"other": OTHER, "module": MODULE}


def _load(path: Path, name: str, text: str) -> ModuleType:
    path.write_text(text, encoding="utf-8")
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec
    assert spec.loader
    made = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


def test_the_text_does_what_the_modules_do(module: ModuleType):
    carried = carry(module.ask, module.Thing)
    text = "\n".join(("from __future__ import annotations", *carried.imports, carried.text))
    space: dict[str, object] = {}
    exec(compile(text, "carried", "exec"), space)
    assert eval("ask(Thing())", space) == module.ask(module.Thing())
    assert carried.imports == ("import math",)
    assert "_STEP_of_module" in text
    assert "not_asked" not in text
    assert "Unused" not in text
    assert "half_turn" not in text
    assert '"""Two numbers."""' in text


def test_a_module_of_ours_as_a_whole_is_refused(tmp_path: Path):
    text = "import station.physics\n\ndef f():\n    return station.physics\n"
    made = _load(tmp_path / "whole.py", "station.whole", text)
    with pytest.raises(UserError, match=r"Expected `from station\.physics import …` in station\.whole"):
        carry(made.f)
    del sys.modules["station.whole"]
