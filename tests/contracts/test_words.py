"""Docstrings of the program begin with a subject or a verb, not with half a question; Args and Returns tell shapes."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HALVES = frozenset({"Of", "Whether", "How"})
"""The first words of sentences without a main verb: "Of the mean theta", "Whether it fits", "How far it went"."""
CLAUSES = frozenset({"What", "Where", "When", "Which", "Who", "Why"})
"""The first words of clauses that stand for a noun; they are on their way out, and none may come in."""
MOST_CLAUSES = {"pi_agent": 0, "shared": 0, "station": 10}
"""The number of them that are left in each folder; lower it with each one that goes."""

Told = tuple[str, str]
"""Where a docstring stands, and its first line."""


def docstrings(folder: str) -> Iterator[Told]:
    """Every docstring of a folder's modules, classes, functions and constants."""
    for path in sorted((ROOT / folder).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            for line, text in _texts(node):
                yield f"{path.relative_to(ROOT)}:{line}", text.strip().split("\n")[0]


def _texts(node: ast.AST) -> Iterator[tuple[int, str]]:
    """Line and text of what documents the node, and of what documents the constants in it."""
    documented = isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
    if not documented:
        return
    for before, one in zip([None, *node.body], node.body, strict=False):
        told = before is None or isinstance(before, ast.Assign | ast.AnnAssign)
        if told and isinstance(one, ast.Expr) and isinstance(one.value, ast.Constant):
            yield one.lineno, str(one.value.value)


def beginning_with(folder: str, words: frozenset[str]) -> list[str]:
    found = ((where, line) for where, line in docstrings(folder) if line)
    return [f"{where}: {line}" for where, line in found if line.split()[0].rstrip(",:;") in words]


@pytest.mark.parametrize("folder", MOST_CLAUSES)
def test_no_docstring_begins_with_half_a_question(folder: str) -> None:
    assert beginning_with(folder, HALVES) == []


@pytest.mark.parametrize(("folder", "most"), MOST_CLAUSES.items())
def test_clauses_in_the_place_of_sentences_only_become_fewer(folder: str, most: int) -> None:
    found = beginning_with(folder, CLAUSES)
    assert len(found) <= most, "\n".join(found)


@pytest.mark.parametrize("folder", MOST_CLAUSES)
def test_no_docstring_only_points_elsewhere(folder: str) -> None:
    """A reader of "See the module" has learnt nothing; a method that repeats its protocol's may name that."""
    found = [f"{where}: {line}" for where, line in docstrings(folder) if line.lower().startswith("see the module")]
    assert found == []
