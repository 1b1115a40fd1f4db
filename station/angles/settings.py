"""The `[angles.<name>]` tables of rig.toml: what every source has in common; the rest goes to the source itself."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from shared.config import Table, parse


@dataclass(frozen=True, kw_only=True)
class SourceSettings:
    """The settings that every angle source has.

    `kind` is a file in station/angles/sources (by default the table's own name), `sigma_deg` one reading's standard
    deviation as the maker states it. A source that says nothing for `silent_s` is reported and opened anew every
    `retry_s`; 0 never (the default of sources that speak when asked). A change by more than `jump_deg` beyond what
    the plate can turn meanwhile at `max_rate_deg_s` is reported as a jump.
    """

    kind: str = ""
    sigma_deg: float = 0.0
    silent_s: float = -1.0
    jump_deg: float = 5.0
    max_rate_deg_s: float = 60.0
    retry_s: float = 2.0

    def __post_init__(self) -> None:
        for name in ("sigma_deg", "jump_deg", "max_rate_deg_s", "retry_s"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise ValueError(f"expected a number of 0 or more for '{name}', got {value}")


SILENT_S = 2.0


@dataclass(frozen=True, slots=True)
class SourceName:
    """A source's name, its kind, and whether it speaks only when it is asked."""

    name: str
    kind: str
    on_demand: bool = False


def split_table(table: Table) -> tuple[SourceSettings, Table]:
    """Returns the common settings of a source's table, and the table that is left for the source.

    Raises:
        UserError: naming file, line and key of what is wrong.
    """
    common = {spec.name for spec in fields(SourceSettings)}
    mine = {key: value for key, value in table.values.items() if key in common}
    rest = {key: value for key, value in table.values.items() if key not in common}
    where = (table.file, table.text, table.path)
    return parse(SourceSettings, Table(mine, *where)), Table(rest, *where)
