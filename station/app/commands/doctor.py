"""Says how a recording is: rates, gaps, latencies, losses, clocks, phases, and every broken rule of the format.

Of several recordings, a glob or a folder, and with --out, it prints a row each (station/app/many/README.md).
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from dataclasses import replace

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from shared.notes import note_line
from shared.visible import visible
from station.app.attached import planted_in_recording
from station.app.many.checkups import checking, report_json
from station.app.many.options import add_files, add_out, add_spreading, chosen_by, work_through
from station.app.many.remote import local
from station.app.many.shown import exit_status
from station.recording.checkup.report import Report, examine
from station.recording.checkup.rules import Finding, findings
from station.recording.checkup.streams import StreamHealth
from station.recording.reader import digest, open_recording

NAME = "doctor"
HELP = "check a recording: rates, gaps, latency, losses, clocks, phases; exit status 1 when a rule is broken"
EXAMPLE = "station doctor sim.mcap"
ONE = "a rule of the format or of a good session is broken, or of many recordings some could not be read"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    add_files(parser, tables=False)
    add_out(parser)
    parser.add_argument("--json", action="store_true", help="print everything as JSON")
    parser.add_argument("--digest", action="store_true", help="add the SHA-256 of every measured message")
    add_spreading(parser)


def run(args: argparse.Namespace) -> int:
    """Prints the report, or a row for each recording; gives 1 when a rule is broken."""
    found = chosen_by(args, tables=False)
    if not (found.one and args.out is None):
        rows = work_through(found, checking(with_digest=args.digest), args, out=args.out)
        return exit_status(rows, findings=any(row.result.get("findings") for row in rows))
    reader = open_recording(local(found.names[0]))
    report = replace(examine(reader), path=found.names[0])
    broken = findings(report)
    sha = digest(reader) if args.digest else ""
    if args.json:
        print(json.dumps(report_json(report, broken, sha), indent=2, allow_nan=False))
    else:
        _print(report, broken, sha, notes=planted_in_recording(reader))
    return 1 if broken else 0


def _print(report: Report, broken: tuple[Finding, ...], sha: str, *, notes: tuple[str, ...]) -> None:
    console = Console(width=None if sys.stdout.isatty() else 140, highlight=False)
    mode = visible(report.mode) or "of unknown origin"
    console.print(f"{report.path}: {report.duration_s:.1f} s, {mode}", markup=False)
    console.print(_streams_table(report.streams))
    for line in _lines(report):
        console.print(visible(line), markup=False)
    for note in notes:
        console.print(note_line(note), markup=False)
    if sha:
        console.print(f"digest  {sha}")
    for finding in broken:
        console.print(visible(f"✗ {finding.rule}: {finding.sentence}"), style="red", markup=False)
    if not broken:
        console.print("✓ no rule broken", style="green")


def _streams_table(streams: tuple[StreamHealth, ...]) -> Table:
    table = Table(
        title="Topics (interval and gap between captures; latency from capture to record)", title_justify="left"
    )
    table.add_column("topic")
    columns = (
        "count",
        "Hz",
        "at least",
        "jitter p99 ms",
        "gaps",
        "longest s",
        "p50 ms",
        "p99 ms",
        "missing",
        "not found",
    )
    for column in columns:
        table.add_column(column, justify="right")
    for stream in streams:
        least = f"{stream.nominal_hz:g}" if stream.nominal_hz else "–"
        timing = [_figure(value, 2) for value in (stream.latency_p50_ms, stream.latency_p99_ms)]
        table.add_row(
            escape(visible("/" + stream.topic)),
            str(stream.count),
            _figure(stream.rate_hz, 1),
            least,
            _figure(stream.jitter_p99_ms, 2),
            str(stream.gaps),
            _figure(stream.gap_max_s, 3),
            *timing,
            str(stream.missing),
            str(stream.not_found),
        )
    return table


def _figure(value: float, digits: int) -> str:
    return "–" if math.isnan(value) else f"{value:.{digits}f}"


def _lines(report: Report) -> list[str]:
    session, arm = report.session, report.arm
    phases = ", ".join(f"{phase} {count}" for phase, count in session.phases.items()) or "none"
    lines = [
        f"samples {session.samples} ({session.kept} kept, {session.censored} censored) of {session.runs} runs",
        f"phases  {phases}",
        f"losses  {_recorder_line(report)}",
        f"        camera agent: {session.agent_dropped} frames dropped",
    ]
    lines += [
        f"clock   {clock.agent}: {clock.offset_ms:+.3f} ± {clock.sigma_ms:.3f} ms (spread {clock.spread_ms:.3f} ms, "
        f"round trip {clock.rtt_ms:.3f} ms)"
        for clock in session.clocks
    ]
    if arm.commands:
        lines.append(
            f"arm     {arm.commands} commands; to begin p50 {_figure(arm.begin_p50_ms, 1)}, p99 "
            f"{_figure(arm.begin_p99_ms, 1)} ms; to motion of 0.02° p50 {_figure(arm.seen_p50_ms, 1)}, p99 "
            f"{_figure(arm.seen_p99_ms, 1)} ms; {len(arm.faults)} faults"
        )
    if report.scale.run:
        lines.append(
            f"scale   the mark's side is up to {report.scale.off:.2%} off what it is said to be, by the plate's map "
            f"(run {report.scale.run})"
        )
    if report.repair:
        lines.append(f"repair  {report.repair.get('lost_bytes', '0')} bytes were lost when the session broke off")
    history = sum(stream.history for stream in report.streams)
    if history:
        lines.append(
            f"history {history} messages were captured before the session and recovered (not in the latencies)"
        )
    lines += [f"warning {line}" for line in session.last_warnings]
    return lines


def _recorder_line(report: Report) -> str:
    if report.recorder:
        counts = (f"{report.recorder.get(what, 0)} {what}" for what in ("dropped", "missed", "duplicates"))
        return "recorder: " + ", ".join(counts)
    return "recorder: no count, the session broke off" if report.mode == "live" else "recorder: nothing can be lost"
