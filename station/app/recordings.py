"""Names new recordings, and tells their origin, also that of others."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from datetime import datetime
from pathlib import Path

from shared.rig import RigConfig
from station.friction.onset import RULE
from station.recording.provenance import Provenance, whole_number
from station.recording.reader import RecordingReader
from station.sampling.plan import Plan

FOLDER = Path("recordings")
_ONSET_RULE = "onset_rule"
SPLIT_MB = (1, 1_000_000)
"""The sizes of a part: at least as large as a chunk, so that there are not more parts than chunks."""


def recording_path(out: str | None) -> Path:
    """Returns the path of `--out`, or a new one in ./recordings named by the time."""
    return Path(out) if out else FOLDER / f"{datetime.now().astimezone():%Y-%m-%d_%H-%M-%S}.mcap"


def add_split(parser: argparse.ArgumentParser) -> None:
    """Declares `--split`, the size at which a recording goes on in another file."""
    parser.add_argument(
        "--split",
        type=_split_bytes,
        default=0,
        metavar="MB",
        help="go on in NAME.part002.mcap at this size (read as one)",
    )


def _split_bytes(text: str) -> int:
    megabytes = int(text) if text.isascii() and text.isdigit() else 0
    if not SPLIT_MB[0] <= megabytes <= SPLIT_MB[1]:
        raise argparse.ArgumentTypeError(f"expected a size from {SPLIT_MB[0]} to {SPLIT_MB[1]} MB, got '{text}'")
    return megabytes * 1_000_000


def plan_toml(plan: Plan) -> str:
    """Returns the plan as TOML with every constant, so that the recording holds what was used.

    Empty lists are left out.
    """
    values = asdict(plan)
    tables = {name: _said(value) for name, value in values.items() if isinstance(value, dict)}
    lines = [f"{name} = {json.dumps(value)}" for name, value in values.items() if name not in tables]
    for name, table in tables.items():
        lines += ["", f"[{name}]", *(f"{key} = {json.dumps(value)}" for key, value in table.items())]
    return "\n".join(lines) + "\n"


def _said(table: dict[str, object]) -> dict[str, object]:
    return {key: value for key, value in table.items() if value != ()}


def provenance(rig: RigConfig, plan: Plan, *, mode: str, started_ns: int) -> Provenance:
    """Returns the rig file, plan, seed, versions, and the rule by which onsets are estimated."""
    return Provenance(
        rig_id=rig.id,
        started_ns=started_ns,
        mode="lockstep" if mode == "lockstep" else "live",
        seed=plan.seed,
        rig_toml=rig.text,
        own_rig=rig.arm.own,
        plan_toml=plan_toml(plan),
        extra={_ONSET_RULE: str(RULE)},
    )


def other_rule(reader: RecordingReader) -> str:
    """Returns why what was decided may differ from what follows from it now; empty if onsets have the same rule."""
    then = whole_number(reader.metadata.get("session", {}).get(_ONSET_RULE, "1"))
    if then == RULE:
        return ""
    return (
        f"its onsets were estimated by rule {'unknown' if then is None else then}, this program has rule {RULE}: "
        "onsets, their errors, runs' flags, and what was decided by them, may differ by that alone"
    )
