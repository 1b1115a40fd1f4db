"""`station diagnose` for each of many recordings."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from station.app.diagnosing import diagnose_file
from station.app.many.each import Result
from station.app.many.options import Command
from station.app.many.shown import Shown
from station.diagnosis.result_json import as_json


def diagnosing(**asked: Any) -> Command:
    """Returns the command with its options, which are those of `diagnose_file`."""
    work = partial(diagnosed, **asked)
    return Command(name="diagnose", work=work, asked=asked, shown=Shown(columns=_COLUMNS, cells=_cells), quick=False)


def placed(asked: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the options with the paths of files from the root: a worker of a cluster has another working folder."""
    return {name: _placed(value) for name, value in asked.items()}


def _placed(value: Any) -> Any:
    if isinstance(value, list):
        return [_placed(one) for one in value]  # pyright: ignore[reportUnknownVariableType]
    if isinstance(value, Path):
        return value.absolute()
    named = isinstance(value, str) and Path(value.partition(":")[0]).is_file()
    return str(Path(value).absolute()) if named else value


def diagnosed(path: Path, name: str, **asked: Any) -> Result:
    """Returns the answer of a recording, as `--json` prints it."""
    return as_json(diagnose_file(path, name=name, **asked).diagnosis)


_COLUMNS = ("runs", "verdict", "effects", "p", "gap closed", "s")


def _cells(result: Result) -> tuple[str, ...]:
    named = [one["id"] for one in result["effects"] if one["verdict"] in ("supported", "indistinguishable")]
    closed = result["fit"]["gap_closed"]
    return (
        str(result["runs"]["used"]),
        result["verdict"],
        ", ".join(named) or "–",
        f"{result['global_p']:.2g}",
        "–" if closed is None else f"{100.0 * closed:.0f} %",
        f"{result['seconds']:.0f}",
    )
