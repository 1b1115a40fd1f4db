"""The report: tables for the terminal and for a README, and everything as JSON."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from rich.table import Table

from station.prove.gates import Gate
from station.prove.scoring import Scored
from station.prove.versus import Line

COLUMNS = ("figure", "value", "95 % interval", "n", "gate", "met")
RIVAL_COLUMNS = ("method", "name right", "names on nulls", "place right", "held-out gain per run", "gap closed", "note")


@dataclass(frozen=True, kw_only=True)
class About:
    """Where the figures come from."""

    date: str
    command: str
    versions: Mapping[str, str]
    seed: int
    tiers: Mapping[str, int]
    seals: Mapping[str, str]
    tool: str
    not_made: Mapping[str, str]


def row(gate: Gate) -> tuple[str, ...]:
    """A gate as text."""
    return gate.title, shown(gate), interval(gate), str(gate.cases), gate.asked, verdict(gate)


def shown(gate: Gate) -> str:
    """The value."""
    return _text(gate.value, gate.share)


def interval(gate: Gate) -> str:
    """The interval."""
    if not math.isfinite(gate.low):
        return "–"
    return f"{_text(gate.low, gate.share)} … {_text(gate.high, gate.share)}"


def verdict(gate: Gate) -> str:
    """The words that say if it is met, and if so few cases can tell."""
    if not gate.asked:
        return ""
    if gate.met is None:
        return "no cases"
    return ("yes" if gate.met else "NO") + ("" if gate.sure else " (the interval holds both)")


def _text(value: float, share: bool) -> str:
    if not math.isfinite(value):
        return "–"
    return f"{100 * value:.1f} %" if share else f"{value:.3g}"


def printed(gates: Sequence[Gate]) -> Table:
    """For the terminal."""
    table = Table(title="Gates", title_justify="left")
    for number, name in enumerate(COLUMNS):
        table.add_column(name, justify="left" if number in (0, 5) else "right")
    for gate in gates:
        style = "red" if gate.met is False else "green" if gate.met else ""
        table.add_row(*row(gate), style=style)
    return table


def printed_rivals(lines: Sequence[Line]) -> Table:
    """For the terminal."""
    table = Table(title="Rivals on the same cases and folds", title_justify="left")
    for name in RIVAL_COLUMNS:
        table.add_column(name)
    for line in lines:
        table.add_row(*rival_row(line))
    return table


def rival_row(line: Line) -> tuple[str, ...]:
    """A rival as text: value, interval and number of cases."""
    return line.title, *(f"{shown(c)} ({interval(c)}; n {c.cases})" if c.cases else "–" for c in line.cells), line.note


def markdown(
    about: About,
    gates: Sequence[Gate],
    lines: Sequence[Line],
    left: Mapping[str, Counter[str]],
    pictures: Sequence[str],
) -> str:
    """The table as it can stand in a README."""
    tiers = ", ".join(f"{name} {count}" for name, count in about.tiers.items())
    versions = ", ".join(f"{name} {version}" for name, version in about.versions.items())
    text = [
        f"Measured {about.date} with `{about.command}` (seed {about.seed}; {tiers}; tool {about.tool}; {versions}).",
        "", *_table(COLUMNS, [row(gate) for gate in gates]),
    ]  # fmt: skip
    if lines:
        text += ["", "Rivals, on the same cases and folds:", "", *_table(RIVAL_COLUMNS, [rival_row(x) for x in lines])]
    text += ["", *(f"- Tier {name}: {why}" for name, why in about.not_made.items())]
    text += [
        f"- Parameters of {name} left out {sum(why.values())} times: {next(iter(why))}" for name, why in left.items()
    ]
    text += ["", *(f"- Key of tier {name}: sha256 {digest}" for name, digest in about.seals.items())]
    text += ["", *(f"![{name}]({name}.png)" for name in pictures)]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(text)).strip() + "\n"


def _table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    return [_line(columns), _line(["---"] * len(columns)), *(_line(one) for one in rows)]


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"


def as_json(about: About, gates: Sequence[Gate], lines: Sequence[Line], cases: Sequence[Scored]) -> dict[str, Any]:
    """Everything; a number that does not exist is null."""
    return _finite(
        {
            "about": asdict(about),
            "gates": [asdict(gate) | {"met": gate.met, "sure": gate.sure} for gate in gates],
            "rivals": [asdict(line) for line in lines],
            "cases": [_case(case) for case in cases],
        }
    )


def _case(case: Scored) -> dict[str, Any]:
    return {
        "id": case.truth.id,
        "tier": case.tier,
        "concealed": [{"id": effect.id, "strength": effect.strength} for effect in case.truth.effects],
        "first": case.said.first,
        "claimed": [list(effect["class"]) for effect in case.said.claimed],
        "right_first": case.right_first,
        "auc": case.aucs(),
        "pulls": [asdict(pull) for pull in case.pulls()[0]],
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
