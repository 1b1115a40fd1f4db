"""Docstrings of the program and its tests begin with a subject or a verb, not with half a question."""

from __future__ import annotations

import ast
import io
import tokenize
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HALVES = frozenset(
    {
        *("Of", "Whether", "How", "From", "By", "As", "After", "Below", "Above", "Between", "Within", "So", "About"),
        *("Not", "And", "But", "Than", "Per", "Against", "Both", "Those", "That", "In", "On", "At", "Or", "Because"),
        *("What", "Where", "When", "Which", "Who", "Why"),
    }
)
"""The first words of sentences without a main verb: "Of the mean theta", "Whether it fits", "From words to a mark"."""
HALF_COMMENTS = frozenset({"of", "what", "whether", "how", "nor", "else", "so"})
"""The first words of comments that must be read together with the code, or twice: "of f (1 - f)", "nor is this"."""
SHIPPED = ("deploy", "pi_agent", "shared", "station")
FOLDERS = ("pi_agent", "shared", "station", "tests")

Told = tuple[str, str]
"""The place of a docstring, and its first line."""


@cache
def docstrings(folder: str) -> list[Told]:
    """Every docstring of a folder's modules, classes, functions and constants, read once for all tests."""
    return [
        (f"{path.relative_to(ROOT)}:{line}", text.strip().split("\n")[0])
        for path in sorted((ROOT / folder).rglob("*.py"))
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        for line, text in _texts(node)
    ]


def _texts(node: ast.AST) -> Iterator[tuple[int, str]]:
    """Line and text of what documents the node, and of what documents the constants in it."""
    documented = isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
    if not documented:
        return
    for before, one in zip([None, *node.body], node.body, strict=False):
        told = before is None or isinstance(before, ast.Assign | ast.AnnAssign)
        if told and isinstance(one, ast.Expr) and isinstance(one.value, ast.Constant):
            yield one.lineno, str(one.value.value)


@pytest.mark.parametrize("folder", FOLDERS)
def test_no_docstring_begins_with_half_a_question(folder: str) -> None:
    found = ((where, line) for where, line in docstrings(folder) if line)
    assert [f"{where}: {line}" for where, line in found if line.split()[0].rstrip(",:;") in HALVES] == []


def comments(folder: str) -> Iterator[Told]:
    """Every comment of a folder: where it begins, and its first line."""
    for path in sorted((ROOT / folder).rglob("*.py")):
        before = -1
        for token in tokenize.generate_tokens(io.StringIO(path.read_text(encoding="utf-8")).readline):
            if token.type == tokenize.COMMENT:
                alone = not token.line[: token.start[1]].strip()
                if not (alone and token.start[0] == before + 1):
                    yield f"{path.relative_to(ROOT)}:{token.start[0]}", token.string.lstrip("# ")
                before = token.start[0] if alone else -1


@pytest.mark.parametrize("folder", FOLDERS)
def test_no_comment_begins_in_the_middle_of_a_thought(folder: str) -> None:
    begun = ((where, line, line.lower().replace(",", " ").split()) for where, line in comments(folder))
    assert [f"{where}: {line}" for where, line, words in begun if words and words[0] in HALF_COMMENTS] == []


@pytest.mark.parametrize("folder", SHIPPED)
def test_no_docstring_only_points_elsewhere(folder: str) -> None:
    """A reader of "See `Camera.open`" has learnt nothing: a method says what it does here."""
    told = docstrings(folder)
    assert [f"{where}: {line}" for where, line in told if line.lower().startswith("see ")] == []


@pytest.mark.parametrize("folder", FOLDERS)
def test_no_docstring_points_to_a_module(folder: str) -> None:
    told = ((where, line.lower()) for where, line in docstrings(folder))
    assert [f"{where}: {line}" for where, line in told if line.startswith(("see the module", "see the base"))] == []
