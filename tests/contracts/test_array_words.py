"""Public functions that take or give arrays say the shape and unit of each: `corners_px: (n, 4, 2), px`, or in words.

The names in `array_words_missing.txt` do not yet: the list only shrinks.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = ("shared", "pi_agent", "station")
MISSING = Path(__file__).with_name("array_words_missing.txt")
SHAPE = r"\((?:\d+|[a-z]\w*|…)(?:, ?(?:\d+|[a-z]\w*|…))*,?\)"
"""A shape as numpy writes it: (n,), (n, 4, 2), (3, 3); dots stand for any further axes."""
_TERM = r"(?:(?:\d+ )?[A-Za-z_]\w*|\d+)"
_AXIS = rf"(?:…|{_TERM}(?: (?:[-+−×/]|or) {_TERM})*)"
GIVEN = rf"\({_AXIS}(?:, {_AXIS})+\)|\({_AXIS},\)"
"""The shape of what is given, as a tuple is written, with sums and products too: (n,), (3 n, 2), (m - 1, 4, n)."""
ALIKE = r"\b(same|shape|as large|as long|as many)\b"
"""The words of a result with the shape of an argument."""

Function = ast.FunctionDef | ast.AsyncFunctionDef


@cache
def modules() -> dict[Path, ast.Module]:
    """All modules of the folders, each parsed once for all tests."""
    files = [path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*.py"))]
    return {path: ast.parse(path.read_text(encoding="utf-8")) for path in files}


def public_functions(module: ast.Module) -> Iterator[tuple[str, Function]]:
    """Functions of a module and methods of its classes whose names, and whose class's, have no leading underscore."""
    for node in module.body:
        if isinstance(node, Function) and not node.name.startswith("_"):
            yield node.name, node
        elif isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            for inner in node.body:
                if isinstance(inner, Function) and not inner.name.startswith("_"):
                    yield f"{node.name}.{inner.name}", inner


def aliases(trees: dict[Path, ast.Module]) -> dict[Path, set[str]]:
    """The names that stand for an array in each module: those that it defines, and those that it imports."""
    own = {path: {name for node in tree.body if (name := _alias(node))} for path, tree in trees.items()}
    by_module = {".".join(path.relative_to(ROOT).with_suffix("").parts): names for path, names in own.items()}
    by_module |= {name.removesuffix(".__init__"): names for name, names in by_module.items()}
    for _ in range(3):  # a name may be handed on through modules
        for path, tree in trees.items():
            for node in tree.body:
                if isinstance(node, ast.ImportFrom) and node.module:
                    known = by_module.get(node.module, set())
                    own[path] |= {one.asname or one.name for one in node.names if one.name in known}
    return own


def _alias(node: ast.stmt) -> str:
    if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
        told = ast.unparse(node.value)
        return node.targets[0].id if re.match(r"(np\.)?(typing\.)?(NDArray|ndarray)\b", told) else ""
    return ""


def arrays(function: Function, known: set[str]) -> list[str]:
    """The parameters that are arrays, or arrays or None."""
    arguments = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
    pattern = rf"({'|'.join(['NDArray', 'np.ndarray', *known])})(\[.*\])?( \| None)?"
    return [one.arg for one in arguments if one.annotation and re.fullmatch(pattern, ast.unparse(one.annotation))]


def untold(function: Function, known: set[str]) -> list[str]:
    """The array parameters of which the docstring gives no name, or no shape near the name."""
    told = " ".join((ast.get_docstring(function) or "").split())
    return [name for name in arrays(function, known) if not _has_shape(name, told)]


def _has_shape(name: str, told: str) -> bool:
    """True if the name and a shape stand in one sentence or in one line of a list of arguments."""
    return bool(re.search(rf"\b{name}\b[^.]*?{SHAPE}", told))


def gives_arrays(function: Function, known: set[str]) -> bool:
    """True if the function gives an array, or something that consists of arrays by its annotation."""
    given = "" if function.returns is None else ast.unparse(function.returns)
    return bool(re.search(rf"(?<![\w.])({'|'.join(['NDArray', 'np.ndarray', *known])})(?!\w)", given))


def says_what_it_gives(function: Function, known: set[str]) -> bool:
    """True if the docstring has a shape beside those of the array parameters, or says that the result is like one."""
    told = " ".join((ast.get_docstring(function) or "").split())
    shapes = len(re.findall(GIVEN, told))
    if not arrays(function, known):
        return shapes > 0
    return shapes > 1 or bool(shapes and re.search(ALIKE, told))


def found(*, takes: bool) -> tuple[set[str], int]:
    """The functions that lack words on the arrays that they take, or else give, and how many have any."""
    known = aliases(modules())
    lacking, every = set[str](), 0
    for path, module in modules().items():
        for name, function in public_functions(module):
            if takes:
                every += bool(arrays(function, known[path]))
                lacks = bool(untold(function, known[path]))
            else:
                every += (gives := gives_arrays(function, known[path]))
                lacks = gives and not says_what_it_gives(function, known[path])
            if lacks:
                lacking.add(f"{path.relative_to(ROOT).as_posix()}: {name}")
    return lacking, every


def test_whoever_takes_arrays_says_their_shapes() -> None:
    lacking, every = found(takes=True)
    listed = set(MISSING.read_text(encoding="utf-8").splitlines())
    assert every > 300
    assert sorted(lacking - listed) == [], "say the shape and the unit of each array, as in `corners_px: (n, 4, 2), px`"
    assert sorted(listed - lacking) == [], f"these are told by now: take them off {MISSING.name}"


def test_whoever_gives_arrays_says_their_shapes() -> None:
    lacking, every = found(takes=False)
    assert every > 450
    assert sorted(lacking) == [], "say the shape and the unit of what is given, as in 'The corners (n, 4, 2), px'"


def test_a_function_without_words_is_seen() -> None:
    text = 'def f(a_px: Array, n: int) -> None:\n    """Draws `a_px`{}."""'
    (bare,), (told,) = (ast.parse(text.format(more)).body for more in ("", " (n, 2)"))
    assert isinstance(bare, ast.FunctionDef)
    assert isinstance(told, ast.FunctionDef)
    assert untold(bare, {"Array"}) == ["a_px"]
    assert untold(told, {"Array"}) == []


@pytest.mark.parametrize(
    ("arguments", "told", "enough"),
    [
        ("", "The corners.", False),
        ("", "The corners (see below), and the table (magnified).", False),
        ("", "A law (Howe & Cutkosky 1996, IJRR 15, 557).", False),
        ("", "The corners (n, 4, 2), px.", True),
        ("", "The times (n,), s.", True),
        ("", "The nodes (3 n, 2), m.", True),
        ("", "The pieces (m - 1, 4, n), rad.", True),
        ("", "Light (…, n) or (…,).", True),
        ("a: Array", "The corners of `a` (n, 2).", False),
        ("a: Array", "The corners (n, 4, 2), px, of `a` (n, 2).", True),
        ("a: Array", "The light of `a` (n, 2), in the same shape.", True),
    ],
)
def test_a_result_without_a_shape_is_seen(arguments: str, told: str, enough: bool) -> None:
    (function,) = ast.parse(f'def f({arguments}) -> tuple[Array, int]:\n    """{told}"""').body
    assert isinstance(function, ast.FunctionDef)
    assert gives_arrays(function, {"Array"})
    assert not gives_arrays(function, {"Arrays"})
    assert says_what_it_gives(function, {"Array"}) is enough
