"""The report: one table of all families, for the terminal and for a README, and everything as JSON."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from rich.table import Table

from tests.proof.gates import Gate, gates
from tests.proof.pictures import Shown
from tests.proof.run import Proof, left_out
from tests.proof.scoring import Scored
from tests.proof.versus import Line

RIVAL_COLUMNS = (
    "method", "name right", "names on nulls", "place right", "unseen onsets, deg", "unseen paths, mm",
    "held-out gain per run", "gap closed", "note",
)  # fmt: skip
MISSED, NO_CASES = "MISSED", "no such cases"


@dataclass(frozen=True, kw_only=True)
class About:
    """The origin of the figures."""

    date: str
    command: str
    versions: Mapping[str, str]
    seed: int
    tool: str

    @property
    def told(self) -> str:
        """Seed, tool and versions in words."""
        versions = ", ".join(f"{name} {version}" for name, version in self.versions.items())
        return f"seed {self.seed}; tool {self.tool}; {versions}"


@dataclass(frozen=True, kw_only=True)
class Column:
    """A family's part of the report: its gates, its rivals (none if they did not run), its pictures."""

    proof: Proof
    gates: Sequence[Gate]
    lines: Sequence[Line] = ()
    pictures: Sequence[Shown] = field(default=())

    @property
    def title(self) -> str:
        """The family's."""
        return self.proof.family.title

    @property
    def tiers(self) -> Mapping[str, int]:
        """The number of cases of each tier that was made."""
        return Counter(case.tier for case in self.proof.cases)


def column_of(proof: Proof, lines: Sequence[Line] = (), pictures: Sequence[Shown] = ()) -> Column:
    """The column of a family's proof."""
    return Column(proof=proof, gates=gates(proof.cases), lines=lines, pictures=pictures)


def rows(columns: Sequence[Column]) -> list[tuple[str, ...]]:
    """The table: figure, gate, and a cell of each family; a gate that is missed is marked in its own family's cell."""
    return [
        (each[0].title, each[0].asked, *(cell(gate) for gate in each))
        for each in zip(*(column.gates for column in columns), strict=True)
        if any(gate.cases for gate in each)
    ]


def cell(gate: Gate) -> str:
    """A figure with its interval and number of cases, and what it misses."""
    if not gate.cases:
        return NO_CASES
    between = f"{interval(gate)}; " if interval(gate) else ""
    told = f"{_text(gate.value, gate.share)} ({between}n {gate.cases})"
    if gate.met is not False:
        return told
    return f"{MISSED} {told}" if gate.sure or not interval(gate) else f"{MISSED}, perhaps by chance: {told}"


def interval(gate: Gate) -> str:
    """The interval; empty where there is none."""
    if not math.isfinite(gate.low):
        return ""
    return f"{_text(gate.low, gate.share)} … {_text(gate.high, gate.share)}"


def _text(value: float, share: bool) -> str:
    if not math.isfinite(value):
        return "–"
    return f"{100 * value:.0f} %" if share else f"{value:.2g}"


def printed(columns: Sequence[Column]) -> Table:
    """For the terminal."""
    table = Table(title="Gates by family", title_justify="left")
    for name in ("figure", "gate", *(column.title for column in columns)):
        table.add_column(name)
    for row in rows(columns):
        missed = any(text.startswith(MISSED) for text in row)
        table.add_row(*row, style="red" if missed else "")
    return table


def printed_rivals(column: Column) -> Table:
    """For the terminal."""
    table = Table(title=f"Rivals on the same cases and folds: {column.title}", title_justify="left")
    for name in RIVAL_COLUMNS:
        table.add_column(name)
    for line in column.lines:
        table.add_row(*rival_row(line))
    return table


def rival_row(line: Line) -> tuple[str, ...]:
    """A rival as text: value, interval and number of cases."""
    cells = (f"{_text(c.value, c.share)} ({interval(c) or '–'}; n {c.cases})" if c.cases else "–" for c in line.cells)
    return line.title, *cells, line.note


def markdown(about: About, columns: Sequence[Column]) -> str:
    """The report as it can stand in a README."""
    heads = ("figure", "gate", *(column.title for column in columns))
    table = [tuple(_bold(text) for text in row) for row in rows(columns)]
    text = [f"Measured {about.date} with `{about.command}` ({about.told}).", "", *_table(heads, table), ""]
    for column in columns:
        text += _of_family(column)
    return re.sub(r"\n{3,}", "\n\n", "\n".join(text)).strip() + "\n"


def _bold(text: str) -> str:
    return text.replace(MISSED, f"**{MISSED}**", 1)


def _of_family(column: Column) -> list[str]:
    """Returns the text below the table: the cases, what was left out and why, rivals, the key's hashes, pictures."""
    text = ["", f"## {column.title}: {made(column)}", "", *(f"- {line}" for line in notes(column))]
    if column.lines:
        text += ["", *_table(RIVAL_COLUMNS, [rival_row(line) for line in column.lines])]
    return [*text, "", *(f"![{one.name}]({one.name}.svg)\n\n{one.told}\n" for one in column.pictures)]


def made(column: Column) -> str:
    """The cases that were made, by tier."""
    return ", ".join(f"{tier} {count}" for tier, count in column.tiers.items()) or "nothing was made"


def notes(column: Column) -> list[str]:
    """Says what was not made, what was left out of the comparison of numbers, and the keys' hashes."""
    name, proof = column.proof.family.name, column.proof
    left = left_out(proof.cases)
    return [
        *(f"Tier {tier}: {why}" for tier, why in proof.not_made.items()),
        *(f"Parameters of {one} left out {sum(why.values())} times: {next(iter(why))}" for one, why in left.items()),
        *(f"Key of {name}/{tier}: sha256 {digest}" for tier, digest in proof.seals.items()),
    ]


def _table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    return [_line(columns), _line(["---"] * len(columns)), *(_line(one) for one in rows)]


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"


def as_json(about: About, columns: Sequence[Column]) -> dict[str, Any]:
    """Everything; a number that does not exist is null."""
    return _finite(
        {
            "about": asdict(about),
            "families": {
                column.proof.family.name: {
                    "title": column.title,
                    "tiers": dict(column.tiers),
                    "not_made": dict(column.proof.not_made),
                    "seals": dict(column.proof.seals),
                    "gates": [asdict(gate) | {"met": gate.met, "sure": gate.sure} for gate in column.gates],
                    "rivals": [asdict(line) for line in column.lines],
                    "cases": [_case(case) for case in column.proof.cases],
                }
                for column in columns
            },
        }
    )


def _case(case: Scored) -> dict[str, Any]:
    return {
        "id": case.truth.id,
        "tier": case.tier,
        "kind": case.truth.kind,
        "concealed": [
            {"id": effect.id, "also": effect.also, "strength": effect.strength, "strong": effect.strong}
            for effect in case.truth.effects
        ],
        "first": case.said.first,
        "claimed": [
            {"class": list(effect["class"]), "probability": effect["probability"]} for effect in case.said.claimed
        ],
        "global_p": case.said.answer.get("global_p"),
        "right_first": case.right_first,
        "auc": case.aucs(),
        "pulls": [asdict(pull) for pull in case.pulls()[0]],
        "held_out": {when: case.said.answer.get("fit", {}).get(when) for when in ("before", "after")},
        "gain": case.gain,
        "gap_closed": case.gap_closed,
        "seconds": case.said.wall_s,
    }


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
