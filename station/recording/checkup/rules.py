"""The rules of the format that a recording can break, each with a name. A finding is a rule broken."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from station.recording.checkup.held import BY_CHANCE
from station.recording.checkup.rate import RATE_SHARE
from station.recording.checkup.report import Report
from station.recording.checkup.streams import LATE_NS
from station.recording.malformed import counted
from station.signals.mark_side import IMPOSSIBLE

LATENCY_P99_MS = 15.0
"""Capture to record at 90 Hz on two cores."""
CLOCK_SIGMA_MS = 2.0
_AHEAD_MS = 1.0


@dataclass(frozen=True, slots=True)
class Finding:
    """One broken rule: its name, and one sentence with what was expected and what was found."""

    rule: str
    sentence: str


Rule = Callable[[Report], Iterator[Finding]]


def _block(report: Report) -> Iterator[Finding]:
    if report.stream("camera/corners") is None and report.stream("block/pose") is None:
        yield Finding("block", "expected the block on /camera/corners or /block/pose, found neither")


def _rates(report: Report) -> Iterator[Finding]:
    floors = {"arm/platform": 100.0, "camera/plate": 10.0}
    corners = report.stream("camera/corners")
    if corners is not None:
        floors["camera/corners"] = corners.nominal_hz
        if not report.recorder.get("left_out arm/joints"):
            floors["arm/joints"] = 100.0
    for topic, floor in floors.items():
        stream = report.stream(topic)
        if stream is None:
            if topic == "arm/platform" or corners is not None:
                yield Finding("rate", f"expected {floor:g} Hz on /{topic}, found nothing")
        elif stream.count > 1 and not stream.rate_hz >= RATE_SHARE * floor:
            yield Finding("rate", f"expected {floor:g} Hz on /{topic}, found {stream.rate_hz:.1f} Hz")


def _gaps(report: Report) -> Iterator[Finding]:
    for topic in ("camera/corners", "arm/platform"):
        stream = report.stream(topic)
        if stream is not None and stream.gaps:
            where = f"the longest {stream.gap_max_s * 1e3:.0f} ms at {stream.gap_max_at_s:.2f} s"
            yield Finding("gap", f"expected /{topic} without gaps, found {stream.gaps}, {where}")


def _missing(report: Report) -> Iterator[Finding]:
    for stream in report.streams:
        if stream.missing:
            sentence = f"expected every message of /{stream.topic}, {stream.missing} of its numbers never came"
            dropped = report.session.agent_dropped if stream.topic == "camera/corners" else 0
            yield Finding("missing", sentence + (f" (the agent itself dropped {dropped} frames)" if dropped else ""))


def _latency(report: Report) -> Iterator[Finding]:
    corners = report.stream("camera/corners")
    if corners is not None and corners.latency_p99_ms > LATENCY_P99_MS:
        found = f"{corners.latency_p99_ms:.1f} ms"
        yield Finding("latency", f"expected corners within {LATENCY_P99_MS:g} ms of their capture (p99), found {found}")


def _clocks(report: Report) -> Iterator[Finding]:
    for stream in report.streams:
        if stream.latency_min_ms < -_AHEAD_MS and not stream.topic.startswith("twin/"):  # nobody measures its clock
            early = f"{-stream.latency_min_ms:.1f} ms before"
            yield Finding("clock", f"expected capture before receipt on /{stream.topic}, found a message {early} it")
    known = {clock.agent for clock in report.session.clocks}
    senders = {"camera": "camera/corners", "arm": "arm/platform"}
    if report.mode != "import":
        for agent, topic in senders.items():
            if report.stream(topic) is not None and agent not in known:
                yield Finding("clock", f"expected the offset of the {agent} agent's clock on /clock, found none")
    for clock in report.session.clocks:
        if clock.sigma_ms > CLOCK_SIGMA_MS:
            found = f"± {clock.sigma_ms:.1f} ms"
            yield Finding("clock", f"expected the {clock.agent} agent's clock to within {CLOCK_SIGMA_MS:g} ms, {found}")


def _losses(report: Report) -> Iterator[Finding]:
    for what in ("dropped", "missed", "malformed"):
        if count := report.recorder.get(what, 0):
            topics = [name.removeprefix(f"{what} ") for name in report.recorder if name.startswith(f"{what} ")]
            yield Finding(what, f"expected every message to be recorded, {count} were {what} ({', '.join(topics)})")
    if report.malformed:
        found = counted(report.malformed)
        yield Finding(
            "malformed", f"expected every payload to be a message of its topic, {found} are not and are left out"
        )
    if report.session.agent_dropped:
        yield Finding(
            "dropped", f"expected every frame to be tracked, the agent dropped {report.session.agent_dropped}"
        )


def _calibration(report: Report) -> Iterator[Finding]:
    if report.stream("camera/corners") is not None:
        for topic in ("camera/calibration", "camera/geometry"):
            if report.stream(topic) is None:
                yield Finding("calibration", f"expected the calibration on /{topic}, found none")


def _scale(report: Report) -> Iterator[Finding]:
    scale = report.scale
    if scale.impossible:
        yield Finding(
            "scale",
            f"expected the mark's side within {IMPOSSIBLE:.0%} of what it is said to be, it is up to {scale.off:.0%} "
            f"off on the plate's map, in runs {_list(scale.impossible)}: measure [mark] side_mm, and calibrate the "
            "camera again",
        )


def _provenance(report: Report) -> Iterator[Finding]:
    for name in ("session", "versions"):
        if name not in report.metadata:
            yield Finding(
                "provenance", f"expected the metadata '{name}', found none: where does the recording come from?"
            )
    for name in report.changed_metadata:
        yield Finding(
            "provenance", f"expected the metadata '{name}' as it was written, but its name or its checksum is another's"
        )
    if report.other_rig:
        yield Finding("rig", report.other_rig)
    if report.mode != "import" and "rig.toml" not in report.attachments:
        yield Finding("provenance", "expected the rig file as attachment rig.toml, found none")


def _runs(report: Report) -> Iterator[Finding]:
    session = report.session
    if session.eventless_samples:
        yield Finding(
            "runs", f"expected the phases of every sampled run, runs {_list(session.eventless_samples)} have none"
        )
    if session.sampleless_runs:
        yield Finding(
            "runs", f"expected the sample of every run that was done, runs {_list(session.sampleless_runs)} have none"
        )
    if session.unended_runs:
        yield Finding("runs", f"expected every run but the last to end, runs {_list(session.unended_runs)} did not")


def _fresh(report: Report) -> Iterator[Finding]:
    corners = report.stream("camera/corners")
    if corners is not None and corners.repeated:
        yield Finding(
            "frozen",
            f"expected every frame to be a new one, {corners.repeated} were there before: it was frozen",
        )
    if corners is not None and corners.late:
        yield Finding(
            "late", f"expected every frame within {LATE_NS * 1e-9:g} s of its capture, {corners.late} came later"
        )


def _disturbed(report: Report) -> Iterator[Finding]:
    session = report.session
    if session.disturbed:
        yield Finding(
            "disturbed",
            f"expected runs that nothing disturbs, runs {_list(session.disturbed)} were (see their flags); they count "
            "nowhere",
        )
    if len(session.owners) > 1:
        yield Finding("owner", f"expected one session to have the arm, found {', '.join(session.owners)}")


def _held(report: Report) -> Iterator[Finding]:
    for row in report.session.held:
        low, high, farthest = (f"{math.degrees(tilt):.1f}°" for tilt in (row.low_rad, row.high_rad, row.farthest_rad))
        others = f"; others were tilted to {farthest}: is the range too narrow for this place?"
        yield Finding(
            "held",
            f"expected a block that is held to slip in one of the next runs, runs {row.first} to {row.last} "
            f"({row.count} in a row) were held, up to {low} to {high}; fewer than one session in {1 / BY_CHANCE:.0f} "
            f"has so many by chance{others if row.farthest_rad else ''}",
        )


def _motions(report: Report) -> Iterator[Finding]:
    if report.mode == "import":
        return
    if report.arm.unanswered:
        yield Finding("motion", f"expected the begin of every commanded motion, {report.arm.unanswered} have none")
    if report.arm.unfinished > 1:  # the last one may be under way when a session ends
        yield Finding("motion", f"expected the end of every commanded motion, {report.arm.unfinished} have none")
    if report.arm.commands and not report.session.phases.get("SYNC"):
        yield Finding("sync", "expected one small move seen by camera and arm (phase SYNC) in a session, found none")


def _lost(report: Report) -> Iterator[Finding]:
    for rule, sentence in report.lost.by_rule():
        yield Finding(rule, sentence)


def _format(report: Report) -> Iterator[Finding]:
    for name in report.compression:
        if name not in ("lz4", "zstd"):
            yield Finding("format", f"expected chunks packed with lz4 or zstd, found '{name or 'none'}'")
    if report.unknown:
        names = ", ".join("/" + name for name in report.unknown)
        yield Finding("format", f"expected topics that this version knows, found {names}")


RULES: tuple[Rule, ...] = (
    _block,
    _rates,
    _gaps,
    _missing,
    _latency,
    _clocks,
    _losses,
    _calibration,
    _scale,
    _provenance,
    _runs,
    _fresh,
    _disturbed,
    _held,
    _motions,
    _lost,
    _format,
)


def _list(runs: tuple[int, ...]) -> str:
    shown = ", ".join(str(run) for run in runs[:8])
    return f"{shown}, …" if len(runs) > 8 else shown


def findings(report: Report) -> tuple[Finding, ...]:
    """Returns every broken rule, in the order of the rules."""
    return tuple(finding for rule in RULES for finding in rule(report))
