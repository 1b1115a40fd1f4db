"""One fault at a random moment of a session, and what came of it."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random
from typing import Any

from shared.errors import UserError
from shared.messages import MarkerCorners
from station.app.verifying import Verification, verify
from station.recording.checkup.report import examine
from station.recording.checkup.rules import findings
from station.recording.reader import RecordingReader, open_recording
from station.recording.repair import repair
from tests.faults.lab import FailedError, Lab
from tests.faults.row import Row

RECOVERED_WITHIN_S = 90.0
STARTED_WITHIN_S = 120.0
PHASE_S = 15.0
"""A run takes about that long, so the fault comes in any of its phases."""
REACTS_S = 3.0
"""Corners may stay away for a second (`silence_s`), and a motion under way is ended within its deceleration."""
LEVEL_DEG = 0.3


@dataclass(frozen=True)
class Outcome:
    """The cost of a fault.

    `lost` corners that the camera's own listener heard and the recording lacks, of `corners`; `counted`: missing ones
    that the recording itself tells of; `lost_samples`; `valid`: it opens, its checksums hold and its decisions follow;
    `rose_deg`: by how much the tilt grew later than `REACTS_S` after the fault began, while it lasted; `tilt_deg` when
    it ended; `recovery_s`: from its end to the next run's tilt (nan: not in time).
    """

    row: str
    corners: int
    lost: int
    counted: int
    lost_samples: int
    valid: bool
    rose_deg: float
    tilt_deg: float
    recovery_s: float
    words: str
    doubts: str
    story: tuple[str, ...] = ()
    """The course of the session meanwhile, with the tilt: seconds after the fault began, phase, degrees."""


def try_once(lab: Lab, row: Row, random: Random) -> Outcome:
    """Runs one trial.

    Raises:
        FailedError: if no session can be brought to tilt before the fault.
    """
    lab.revive()
    lab.listen()
    path = lab.session()
    if lab.wait(lambda: lab.tilting(0), within_s=STARTED_WITHIN_S) is None:
        raise FailedError(f"no run tilted within {STARTED_WITHIN_S:g} s: {_tail(lab.folder / 'station.log')}")
    time.sleep(random.uniform(0.0, PHASE_S))
    begin_ns = time.time_ns()
    row.fault(lab, random)
    end_ns = time.time_ns()
    first = path
    if row.ends:
        lab.end("station")
        saved = _saved(first)
        lab.session()
    else:
        saved = ""
    recovery_s = lab.wait(lambda: lab.tilting(end_ns), within_s=RECOVERED_WITHIN_S)
    time.sleep(2.0)
    lab.end("station")
    told = _told(lab, begin_ns, end_ns + round(1e9 * (recovery_s or RECOVERED_WITHIN_S)))
    arm = _arm(lab, begin_ns, end_ns)
    after_s = math.nan if recovery_s is None else recovery_s
    outcome = _judged(lab, row, first, arm=arm, recovery_s=after_s, words=saved or told)
    return replace(outcome, story=_story(lab, begin_ns, end_ns))


def _saved(path: Path) -> str:
    """Makes whole what a cut-off session leaves, as the next start would, and says so."""
    partial = path.with_name(path.name + ".partial")
    if not path.exists() and partial.exists():
        return repair(partial).sentence.partition(": ")[2]
    return ""


def _judged(lab: Lab, row: Row, path: Path, *, arm: tuple[float, float], recovery_s: float, words: str) -> Outcome:
    rose_deg, tilt_deg = arm
    try:
        reader = open_recording(path)
        corners, lost = _corners(lab, reader)
        lost_samples = _samples(lab, reader)
        counted = int(reader.metadata.get("recorder", {}).get("missed", "0"))
        found = verify(path)
    except UserError as error:
        return Outcome(row.name, 0, 0, 0, 0, False, rose_deg, tilt_deg, recovery_s, words, str(error))
    doubts = "; ".join(sorted({finding.rule for finding in findings(examine(reader))}))
    return Outcome(
        row.name, corners, lost, counted, lost_samples, _derives(found), rose_deg, tilt_deg, recovery_s, words, doubts
    )


def _derives(found: Verification) -> bool:
    """True if decisions and samples follow; pictures of a rig that was sabotaged need not show what was seen."""
    return all(part.state == "identical" for part in found.parts if part.name != "corners")


def _corners(lab: Lab, reader: RecordingReader) -> tuple[int, int]:
    """Counts the corners that the camera's listener heard between the recording's ends, and those that it lacks."""
    recorded = set[tuple[int, int]]()
    ends: dict[int, list[int]] = {}
    times: list[int] = []
    for item in reader.messages({"camera/corners"}):
        message = item.message
        assert isinstance(message, MarkerCorners)
        recorded.add((message.boot_id, message.seq))
        ends.setdefault(message.boot_id, []).append(message.seq)
        times.append(item.log_ns)
    if not times:
        return 0, 0
    heard = {
        (told["boot"], told["seq"])
        for told in lab.heard("camera", "camera/corners")
        if min(times) < told["t"] < max(times) - 1_000_000_000
    }
    first = {boot: min(numbers) for boot, numbers in ends.items()}
    heard = {one for one in heard if one[0] not in first or one[1] >= first[one[0]]}
    return len(heard), len(heard - recorded)


def _samples(lab: Lab, reader: RecordingReader) -> int:
    """Samples that the station's listener heard of this session and that are not in its file."""
    kept = {sample.start_ns for sample in reader.samples()}
    heard = {told["start"] for told in lab.heard("station", "session/sample") if told["t"] <= reader.end_ns}
    return len({start for start in heard if start >= reader.start_ns} - kept)


def _arm(lab: Lab, begin_ns: int, end_ns: int) -> tuple[float, float]:
    """Returns how much the tilt grew while the fault lasted, after the time to react, and its end value (deg)."""
    tilts = [(told["t"], math.degrees(told["tilt"])) for told in lab.heard("arm", "arm/platform")]
    during = [tilt for at, tilt in tilts if begin_ns + REACTS_S * 1e9 <= at <= end_ns]
    rose, lowest = 0.0, math.inf
    for tilt in during:
        lowest = min(lowest, tilt)
        rose = max(rose, tilt - lowest)
    before_end = [tilt for at, tilt in tilts if at <= end_ns]
    return (rose if during else math.nan), (before_end[-1] if before_end else math.nan)


def _told(lab: Lab, begin_ns: int, end_ns: int) -> str:
    """Says why a run was given up, in the session's words."""
    events = lab.heard("station", "session/event")
    reasons = [told["reason"] for told in events if told["phase"] == "ABORTED" and begin_ns <= told["t"] <= end_ns]
    return reasons[0] if reasons else "the run went on"


def _story(lab: Lab, begin_ns: int, end_ns: int) -> tuple[str, ...]:
    """The phases from ten seconds before the fault to its end, and the tilt every second."""
    from_ns = begin_ns - 10_000_000_000
    found = [
        (told["t"], f"{told['phase']} {told['reason']}".strip())
        for told in lab.heard("station", "session/event")
        if from_ns <= told["t"] <= end_ns
    ]
    due_ns = from_ns
    for told in lab.heard("arm", "arm/platform"):
        if due_ns <= told["t"] <= end_ns:
            due_ns = told["t"] + 1_000_000_000
            found.append((told["t"], f"{math.degrees(told['tilt']):.1f} deg"))
    return tuple(f"{(at - begin_ns) / 1e9:+.1f} s {what}" for at, what in sorted(found))


def _tail(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="replace")[-300:] if path.exists() else ""


def line_of(name: str, outcomes: Sequence[Outcome], failed: Sequence[str], row: Row) -> dict[str, Any]:
    """One line of the table."""
    recoveries = [one.recovery_s for one in outcomes if not math.isnan(one.recovery_s)]
    late = len(outcomes) - len(recoveries)
    rises = [one.rose_deg for one in outcomes if not math.isnan(one.rose_deg)]
    recovery = f"{statistics.median(recoveries):.0f} ({max(recoveries):.0f})" if recoveries else "–"
    level = sum(one.tilt_deg < LEVEL_DEG for one in outcomes)
    moved = f"{max(rises):.1f}°" if rises and row.blind else "–"
    return {
        "fault": name,
        "n": len(outcomes),
        "corners lost": f"{sum(one.lost for one in outcomes)} of {sum(one.corners for one in outcomes)}",
        "missed, told of": sum(one.counted for one in outcomes),
        "samples lost": sum(one.lost_samples for one in outcomes),
        "valid": f"{sum(one.valid for one in outcomes)}/{len(outcomes)}",
        "rose": moved,
        "level at its end": f"{level}/{len(outcomes)}",
        "next tilt after s": recovery + (f", {late} not in {RECOVERED_WITHIN_S:g} s" if late else ""),
        "words": " / ".join(dict.fromkeys(one.words[:160] for one in outcomes)),
        "doctor": "; ".join(dict.fromkeys(one.doubts for one in outcomes if one.doubts)),
        "failed": "; ".join(failed),
    }
