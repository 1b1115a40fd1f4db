"""The definitions of one Python module as text, and the names that each of them uses.

A definition is a function, a class or an assignment at the module's top level, with the string that describes it.
"""

from __future__ import annotations

import ast
import importlib
import inspect
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, cached_property

from shared.errors import UserError

_OWN = ("station", "shared", "repose_user_effects")
"""The packages whose code an exported file carries; all others are imported by it."""

_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)
_COMPREHENSIONS = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)


@dataclass(frozen=True, eq=False)
class Member:
    """One statement of a class that may be left out where nothing asks for its name."""

    name: str
    nodes: tuple[ast.stmt, ...]


@dataclass(frozen=True, eq=False)
class Definition:
    """Top-level statements of a module that bind `names` together."""

    names: tuple[str, ...]
    nodes: tuple[ast.stmt, ...]

    @cached_property
    def members(self) -> tuple[Member, ...]:
        """The methods and class variables that may be left out; double underscores and fields may not."""
        node = self.nodes[0]
        return tuple(_members(node)) if isinstance(node, ast.ClassDef) else ()

    def without(self, left_out: Iterable[Member]) -> Iterator[ast.AST]:
        """Yields every node below this definition, except those of the members that are left out."""
        out = {id(node) for member in left_out for node in member.nodes}
        waiting: list[ast.AST] = list(self.nodes)
        while waiting:
            node = waiting.pop()
            if id(node) not in out:
                yield node
                waiting.extend(ast.iter_child_nodes(node))


@dataclass(frozen=True)
class Import:
    """The import that binds a name: `from module import name`, or `import module` where `name` is empty."""

    module: str
    name: str = ""

    @property
    def ours(self) -> bool:
        """True if the imported code travels with the file."""
        return self.module.partition(".")[0] in _OWN


class Source:
    """A module's text, its definitions and its imports by the names that they bind."""

    def __init__(self, module: str) -> None:
        self.module = module
        self.text = inspect.getsource(importlib.import_module(module))
        tree = ast.parse(self.text)
        self.lines = self.text.splitlines()
        self.about = ast.get_docstring(tree) or ""
        self.definitions = tuple(_definitions(tree.body))
        self.imports: Mapping[str, Import] = dict(_imports(tree.body))
        self._by_name = {name: one for one in self.definitions for name in one.names}

    def find(self, name: str) -> Definition | Import | None:
        """Finds the statement that binds a name at the top level; None for what Python itself has.

        Raises:
            UserError: if the name is a module of ours, which no single file can hold.
        """
        found = self.imports.get(name)
        if found and found.ours and not found.name:
            raise UserError(f"Expected `from {found.module} import …` in {self.module}, got an import of the module")
        return self._by_name.get(name) or found


@cache
def source_of(module: str) -> Source:
    """Returns the source of a module by its name."""
    return Source(module)


def is_dropped_name(name: str) -> bool:
    """Returns true if a class may lose this member when nothing asks for it."""
    return not (name.startswith("__") and name.endswith("__"))


def _definitions(body: Iterable[ast.stmt]) -> Iterator[Definition]:
    statements = list(body)
    for number, node in enumerate(statements):
        names = _bound(node)
        if names:
            yield Definition(names, (node, *_described(statements, number)))


def _members(node: ast.ClassDef) -> Iterator[Member]:
    for number, each in enumerate(node.body):
        function = isinstance(each, _FUNCTIONS) and is_dropped_name(each.name)
        variable = isinstance(each, ast.AnnAssign) and "ClassVar" in ast.unparse(each.annotation)
        if function or variable:
            yield Member(_bound(each)[0], (each, *_described(node.body, number)))


def _described(statements: list[ast.stmt], number: int) -> tuple[ast.stmt, ...]:
    """Returns the string after an assignment, which describes it."""
    after = statements[number + 1] if number + 1 < len(statements) else None
    is_text = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
    return (after,) if after and is_text and isinstance(statements[number], ast.Assign | ast.AnnAssign) else ()


def _bound(node: ast.stmt) -> tuple[str, ...]:
    """Returns the names that a statement defines, also one with branches; none for an import that stands alone."""
    if isinstance(node, ast.Import | ast.ImportFrom):
        return ()
    if isinstance(node, ast.If | ast.Try):
        within = [each for part in ast.walk(node) if part is not node for each in _bound_here(part)]
        return tuple(dict.fromkeys(within))
    return _bound_here(node)


def _bound_here(node: ast.AST) -> tuple[str, ...]:
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        return (node.name,)
    if isinstance(node, ast.Import | ast.ImportFrom):
        return tuple(each.asname or each.name.partition(".")[0] for each in node.names)
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    return tuple(each.id for target in targets for each in ast.walk(target) if isinstance(each, ast.Name))


def _imports(body: Iterable[ast.stmt]) -> Iterator[tuple[str, Import]]:
    for node in body:
        if isinstance(node, ast.ImportFrom) and node.module != "__future__":
            for each in node.names:
                yield each.asname or each.name, Import(node.module or "", each.name)
        elif isinstance(node, ast.Import):
            for each in node.names:
                yield each.asname or each.name.partition(".")[0], Import(each.name)


def global_names(nodes: Iterable[ast.stmt]) -> list[ast.Name]:
    """Returns the places where statements use names of their module, and not locals that are called alike."""
    found: list[ast.Name] = []
    for node in nodes:
        _collect(node, frozenset(), found)
    return found


def _collect(node: ast.AST, local: frozenset[str], found: list[ast.Name]) -> None:
    if isinstance(node, ast.Name) and node.id not in local:
        found.append(node)
    if isinstance(node, (*_FUNCTIONS, *_COMPREHENSIONS)):
        local |= _locals(node)
    for child in ast.iter_child_nodes(node):
        _collect(child, local, found)


def _locals(scope: ast.AST) -> frozenset[str]:
    """Returns the names that a function or a comprehension binds itself; what is nested in it has its own."""
    arguments = getattr(scope, "args", None)
    names = {each.arg for each in ast.walk(arguments) if isinstance(each, ast.arg)} if arguments else set[str]()
    waiting = list(ast.iter_child_nodes(scope))
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        if not isinstance(node, (*_FUNCTIONS, *_COMPREHENSIONS)):
            waiting.extend(ast.iter_child_nodes(node))
    return frozenset(names)
