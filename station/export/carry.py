"""The source of functions and classes with all that they need of this package, as one text that runs without it.

Each equation has one source: the text is cut out of the modules that the station itself runs. What nothing asks for is
left out, down to a class's methods; names that two modules share get the module's name behind them.
"""

from __future__ import annotations

import ast
import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from station.export.sources import Definition, Import, Member, Source, global_names, source_of

Symbol = tuple[str, str]
"""A module of ours and a name that it defines."""


@dataclass(frozen=True)
class Carried:
    """The text, and the names in it of what was asked for, by their own names."""

    text: str
    imports: tuple[str, ...]
    names: Mapping[Symbol, str]

    def name_of(self, thing: Any) -> str:
        """Returns the name in the text of a function or class that was asked for."""
        return self.names[thing.__module__, thing.__name__]


def carry(*roots: Any) -> Carried:
    """Returns the functions and classes `roots`, with what they need.

    Raises:
        UserError: if one of their modules imports a module of ours as a whole.
    """
    needed = _Needed()
    for root in roots:
        needed.add(root.__module__, root.__name__)
    names = _names(needed)
    parts = [_part(source, needed, names) for source in needed.in_order()]
    text = re.sub(r"\n{4,}", "\n\n\n", "\n\n".join(part for part in parts if part)).strip()
    return Carried(text, _imports(needed, names), names)


class _Needed:
    """The definitions that are needed, and the attributes that they ask for, until nothing more is."""

    def __init__(self) -> None:
        self.definitions: dict[str, dict[Definition, None]] = {}
        self.foreign: dict[Symbol, Import] = {}
        self._users: dict[str, set[str]] = {}
        self._asked: set[str] = set()
        self._left_out: dict[Definition, int] = {}

    def add(self, module: str, name: str) -> None:
        """Adds a name of a module, and all that follows from it."""
        waiting, asked = [(module, name)], -1
        while waiting:
            while waiting:
                self._take(*waiting.pop(), waiting)
            if asked != len(self._asked):  # members that were left out may be needed now, and need more
                asked = len(self._asked)
                waiting = [(one, each.names[0]) for one, known in self.definitions.items() for each in known]

    def left_out(self, definition: Definition) -> list[Member]:
        """Returns the members of a class that nothing asks for."""
        return [member for member in definition.members if member.name not in self._asked]

    def in_order(self) -> list[Source]:
        """Returns the sources, each after those that it takes from."""
        done: dict[str, None] = {}

        def visit(module: str) -> None:
            if module not in done:
                for other in sorted(self._users.get(module, ())):
                    visit(other)
                done[module] = None

        for module in self.definitions:
            visit(module)
        return [source_of(module) for module in done]

    def _take(self, module: str, name: str, waiting: list[Symbol]) -> None:
        found = source_of(module).find(name)
        if isinstance(found, Import):
            self._follow(module, name, found, waiting)
        elif found is not None:
            self.definitions.setdefault(module, {})[found] = None
            left_out = self.left_out(found)
            # Members only come back, so that as many as before are the same: nothing in there is new.
            if self._left_out.get(found) == len(left_out):
                return
            self._left_out[found] = len(left_out)
            nodes = list(found.without(left_out))
            self._asked |= {node.attr for node in nodes if isinstance(node, ast.Attribute)}
            # Words in a table, such as the names of an effect's methods, may be asked for by getattr.
            self._asked |= {str(node.value) for node in nodes if isinstance(node, ast.Constant)}
            names = {node.id for node in nodes if isinstance(node, ast.Name)} - set(found.names)
            waiting += [(module, each) for each in sorted(names) if self._is_new(module, each)]

    def _follow(self, module: str, name: str, found: Import, waiting: list[Symbol]) -> None:
        if not found.ours:
            self.foreign[module, name] = found
            return
        self._users.setdefault(module, set()).add(found.module)
        self.definitions.setdefault(found.module, {})
        if self._is_new(found.module, found.name):
            waiting.append((found.module, found.name))

    def _is_new(self, module: str, name: str) -> bool:
        found = source_of(module).find(name)
        if isinstance(found, Import):
            return found.ours or (module, name) not in self.foreign
        return found is not None and found not in self.definitions.get(module, {})


def _names(needed: _Needed) -> dict[Symbol, str]:
    """Returns the name in the text of every name that a module uses."""
    taken: dict[str, object] = {}
    names: dict[Symbol, str] = {}
    for source in needed.in_order():
        own: list[tuple[str, object]] = [
            (name, (source.module, name))
            for definition in needed.definitions[source.module]
            for name in definition.names
        ]
        own += [(name, found) for (module, name), found in needed.foreign.items() if module == source.module]
        for name, thing in own:
            free = name if taken.setdefault(name, thing) == thing else f"{name}_of_{source.module.rpartition('.')[2]}"
            taken[free] = thing
            names[source.module, name] = free
    for source in needed.in_order():
        for name, found in source.imports.items():
            if found.ours and (symbol := _end_of(found)) in names:
                names[source.module, name] = names[symbol]
    return names


def _imports(needed: _Needed, names: Mapping[Symbol, str]) -> tuple[str, ...]:
    """Returns the import statements, one for each module."""
    found = {(one, names[key]) for key, one in needed.foreign.items()}
    whole = sorted(f"import {one.module}" + _alias(one.module, name) for one, name in found if not one.name)
    modules = sorted({one.module for one, _ in found if one.name})
    taken = {
        module: sorted(one.name + _alias(one.name, name) for one, name in found if one.name and one.module == module)
        for module in modules
    }
    return (*whole, *(f"from {module} import {', '.join(parts)}" for module, parts in taken.items()))


def _alias(what: str, name: str) -> str:
    return "" if name == what else f" as {name}"


def _end_of(found: Import) -> Symbol:
    """Returns the module that defines what an import takes from ours."""
    further = source_of(found.module).find(found.name)
    return _end_of(further) if isinstance(further, Import) and further.ours else (found.module, found.name)


def _part(source: Source, needed: _Needed, names: Mapping[Symbol, str]) -> str:
    """Returns the needed definitions of one module, under a line with its name and its own words as a comment."""
    wanted = needed.definitions[source.module]
    chosen = [one for one in source.definitions if one in wanted]
    if not chosen:
        return ""
    title = f"--- {source.module} ".ljust(116, "-")
    about = [f"# {title}", *(f"# {line}".rstrip() for line in source.about.splitlines())]
    texts = [_text(source, one, needed.left_out(one), names) for one in chosen]
    return "\n".join([*about, "", *_spaced(chosen, texts)])


def _spaced(chosen: Sequence[Definition], texts: Sequence[str]) -> Iterator[str]:
    for one, text in zip(chosen, texts, strict=True):
        yield text if isinstance(one.nodes[0], ast.Assign | ast.AnnAssign) else f"\n\n{text}\n\n"


def _text(source: Source, one: Definition, left_out: Sequence[Member], names: Mapping[Symbol, str]) -> str:
    """Returns the lines of a definition with its names in the text, less the members that are left out."""
    lines = _renamed(source, one, names)
    gone = {number for member in left_out for node in member.nodes for number in _rows(node)}
    kept = [lines[number] for node in one.nodes for number in _rows(node) if number not in gone]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(kept)).rstrip()


def _rows(node: ast.stmt) -> range:
    decorators: Iterable[ast.expr] = getattr(node, "decorator_list", [])
    return range(min([node.lineno, *(one.lineno for one in decorators)]) - 1, node.end_lineno or node.lineno)


def _renamed(source: Source, one: Definition, names: Mapping[Symbol, str]) -> list[str]:
    changes = [(node.lineno - 1, node.col_offset, node.id) for node in global_names(one.nodes)]
    changes += [(number, column, name) for number, column, name in _own_name(source, one)]
    lines = list(source.lines)
    for number, column, name in sorted(set(changes), reverse=True):
        other = names.get((source.module, name), name)
        if other != name:
            line = lines[number].encode()
            lines[number] = (line[:column] + other.encode() + line[column + len(name.encode()) :]).decode()
    return lines


def _own_name(source: Source, one: Definition) -> Iterator[tuple[int, int, str]]:
    """Yields the place of a function's or class's own name, which the syntax tree does not say."""
    node = one.nodes[0]
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        line = source.lines[node.lineno - 1]
        yield node.lineno - 1, len(line[: line.index(node.name, line.index(" ") + 1)].encode()), node.name


def commented(lines: Iterable[str], *, width: int = 116) -> str:
    """Returns lines as comments of Python, wrapped."""
    wrapped = (part for line in lines for part in (textwrap.wrap(line, width, subsequent_indent="  ") or [""]))
    return "\n".join(f"# {line}".rstrip() for line in wrapped)
