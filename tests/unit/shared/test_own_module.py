"""A file of the user's own becomes a module that Python's own tools can look up."""

from __future__ import annotations

from pathlib import Path

import pytest

from shared.own_module import module_in

OWN = """
from __future__ import annotations
from dataclasses import dataclass

@dataclass
class Row:
    run: int = 3
"""


def test_a_file_can_have_dataclasses_whose_types_are_names(tmp_path: Path) -> None:
    """Dataclasses look up the module of such a class by its name: a module that nobody knows ended in a traceback."""
    (tmp_path / "own.py").write_text(OWN)
    assert module_in(tmp_path / "own.py", name="repose_test_own").Row().run == 3


@pytest.mark.parametrize("name", ["none.py", "text.toml"])
def test_what_is_no_python_file_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / "text.toml").write_text("a = 1")
    with pytest.raises(FileNotFoundError, match=name):
        module_in(tmp_path / name, name="repose_test_none")


def test_what_a_file_raises_comes_through(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text("1 / 0")
    with pytest.raises(ZeroDivisionError):
        module_in(tmp_path / "own.py", name="repose_test_raises")
