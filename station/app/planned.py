"""The next experiment as a plan file of its own: what it changes, upon the plan that the recording was made with."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import tomli_w

from shared.config import parse, table_of
from shared.errors import UserError
from station.diagnosis.result import NextExperiment
from station.recording.reader import RecordingReader
from station.sampling.plan import Plan


@dataclass(frozen=True, slots=True)
class RecordedPlan:
    """A session's own plan file, empty if it has none that a session takes, and whether it ran in simulated time."""

    text: str = ""
    lockstep: bool = False

    @classmethod
    def of(cls, reader: RecordingReader) -> RecordedPlan:
        """Returns the plan of a recording."""
        return cls(text=recorded_plan(reader), lockstep=reader.mode == "lockstep")


NO_PLAN = RecordedPlan()


def upon(recorded: RecordedPlan, plan: NextExperiment) -> NextExperiment:
    """Gives the plan with all that it leaves open as in the recorded plan file, if both exist, to be run as it was."""
    plan = replace(plan, lockstep=recorded.lockstep)
    if not recorded.text or not plan.plan:
        return plan
    comments = [line for line in plan.plan.splitlines() if line.startswith("#")]
    changes = {key: value for key, value in tomllib.loads(plan.plan).items() if key in ("samples", *plan.changed)}
    text = "\n".join([*comments, tomli_w.dumps(_merged(tomllib.loads(recorded.text), changes))])
    return replace(plan, plan=text)


def recorded_plan(reader: RecordingReader) -> str:
    """Returns the plan file in a recording; empty if it has none that a session takes."""
    text = reader.attachments.get("plan.toml", b"").decode(errors="replace")
    try:
        parse(Plan, table_of(text, "plan.toml"))
    except UserError:
        return ""
    return text


def write_plan(plan: NextExperiment | None, path: Path) -> str:
    """Writes the plan file if there is a plan; the sentence that says so, or why there is none.

    Raises:
        UserError: if it cannot be written.
    """
    if plan is None or not plan.plan:
        why = "no further experiment is called for" if plan is None else plan.why
        return f"No plan was written to {path}: {why}."
    try:
        path.write_text(plan.plan, encoding="utf-8")
    except OSError as error:
        raise UserError(f"Expected to write the plan to {path}, but that failed: {error.strerror}") from error
    return f"Plan: {path}\nRun it:  {plan.command(str(path))}"


def _merged(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    merged = dict(base)
    for key, value in changes.items():
        both = isinstance(value, dict) and isinstance(base.get(key), dict)
        merged[key] = _merged(base[key], value) if both else value
    return merged
