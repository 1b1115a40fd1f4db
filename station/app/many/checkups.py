"""`station doctor` for each of many recordings."""

from __future__ import annotations

from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

from station.app.many.each import Result
from station.app.many.options import Command
from station.app.many.shown import Shown
from station.app.outputs import without_nan
from station.recording.checkup.report import Report, examine
from station.recording.checkup.rules import Finding, findings
from station.recording.reader import digest, open_recording


def checking(*, with_digest: bool) -> Command:
    """Returns the command with its options."""
    return Command(
        name="doctor",
        work=partial(checked, with_digest=with_digest),
        asked={"digest": with_digest},
        shown=Shown(columns=("seconds", "runs", "samples", "broken rules"), cells=_cells),
        named_by="path",
    )


def checked(path: Path, name: str, *, with_digest: bool) -> Result:
    """Returns the report on a recording, as `--json` prints it."""
    reader = open_recording(path)
    report = replace(examine(reader), path=name)
    return report_json(report, findings(report), digest(reader) if with_digest else "")


def report_json(report: Report, broken: tuple[Finding, ...], sha: str) -> dict[str, Any]:
    """Returns the report as `--json` prints it."""
    values = without_nan(asdict(report))
    return {**values, "findings": [asdict(finding) for finding in broken], **({"digest": sha} if sha else {})}


def _cells(result: Result) -> tuple[str, ...]:
    session = result["session"]
    broken = ", ".join(dict.fromkeys(one["rule"] for one in result["findings"]))
    return f"{result['duration_s']:.1f}", str(session["runs"]), str(session["samples"]), broken or "–"
