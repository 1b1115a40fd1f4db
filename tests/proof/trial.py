"""One blind run of the tool on one case: recording and rig file in, its answer as JSON out."""

from __future__ import annotations

import hashlib
import time
import traceback
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from station.app.diagnosing import diagnose_file
from station.app.work import write_json
from station.diagnosis.result_json import as_json
from tests.proof.families import recording_of

SEED = 1
"""The seed that the tool draws from; it is never another one, so that nobody can choose."""

_SOURCES = ("diagnosis", "physics", "signals", "recording")


@dataclass(frozen=True, kw_only=True)
class Trial:
    """A case (a folder with a recording, perhaps with rig.toml), where its answer goes, the tool's digest."""

    case: Path
    result: Path
    digest: str


def run_trial(trial: Trial) -> None:
    """Runs the tool once and writes what it says; a fault of the tool is an answer as well, and a wrong one."""
    began = time.monotonic()
    answer: dict[str, Any]
    try:
        recorded, rig = recording_of(trial.case), trial.case / "rig.toml"
        assert recorded is not None
        found = diagnose_file(recorded, rig=rig if rig.exists() else None, seed=SEED)
        answer = as_json(found.diagnosis)
    except Exception as error:
        answer = {"error": f"{type(error).__name__}: {error}", "traceback": traceback.format_exc()}
    seconds = time.monotonic() - began
    write_json(trial.result, {"tool": trial.digest, "wall_s": seconds, "answer": answer})


def tool_digest() -> str:
    """A hash of the sources that the answer depends on: results of two versions must not be mixed."""
    folder = Path(__file__).resolve().parents[2] / "station"
    total = hashlib.sha256()
    for name in _SOURCES:
        for path in sorted((folder / name).rglob("*.py")):
            total.update(path.read_bytes())
    return total.hexdigest()[:16]
