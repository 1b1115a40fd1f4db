"""Repeats the paper's study in simulation: four surface pairs, sampled, filtered, tested, and put beside the paper.

The sessions run in lockstep with all cores, one process each; their recordings go into --out/recordings. Whatever
breaks the study off, the same command goes on with the sessions that are not whole. Then it does what `station analyze`
does (report.html, figures, samples, limit_curves.json) and writes study.json: every number that the paper prints, the
simulated one, and the difference in standard errors. A recording takes about 0.5 MB a sample: it
leaves out what nothing that measures reads (station/app/study/essentials.py).
"""

from __future__ import annotations

import argparse
import shutil
import sys
import time
from datetime import datetime
from pathlib import Path

import numpy as np
from rich.console import Console

from shared.arguments import seed_of
from shared.errors import UserError
from shared.system.processes import usable_processors
from station.app.analysing import in_words, notes_of, printed
from station.app.analysis_files import write_results
from station.app.sessions import read_sessions
from station.app.study import paper
from station.app.study.beside import as_json, tables_of
from station.app.study.compare import pace_row, rows_of, verdicts_of
from station.app.study.design import SESSION_SAMPLES, Part, parts_of
from station.app.study.sessions import simulate_all, tidy, whole
from station.app.work import write_json
from station.friction.pairs import pairs_of
from station.friction.results import analyse, with_limit_curves
from station.pages.caption import command_line, made_by
from station.recording.provenance import versions

NAME = "study"
HELP = "repeat the paper's study in simulation and compare"
EXAMPLE = "station study --out study"
BYTES_PER_SAMPLE = 600_000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("--out", type=Path, default=Path("study"), metavar="FOLDER", help="where everything goes")
    parser.add_argument(
        "--samples",
        type=int,
        default=paper.SAMPLES,
        help="samples of all pairs together, by default as many as the paper's",
    )
    parser.add_argument("--seed", type=seed_of, default=1, help="seed of every random choice")
    parser.add_argument("--jobs", type=int, default=0, help="processes; 0: one for each core")
    parser.add_argument(
        "--session-samples", type=int, default=SESSION_SAMPLES, metavar="N", help="at most so many in a session"
    )


def run(options: argparse.Namespace) -> int:
    """Simulates what is missing, analyses all, compares."""
    if options.jobs < 0 or options.session_samples < 1:
        raise UserError(
            f"Expected --jobs of 0 or more and --session-samples of 1 or more, got {options.jobs} and "
            f"{options.session_samples}"
        )
    begin, console = time.perf_counter(), Console(width=None if sys.stdout.isatty() else 150, highlight=False)
    folder = options.out / "recordings"
    parts = parts_of(options.samples, seed=options.seed, folder=folder, session_samples=options.session_samples)
    jobs = options.jobs or usable_processors()
    simulated = _simulate(parts, folder, jobs=jobs)
    simulating_s = time.perf_counter() - begin
    console.print(f"Simulated: {simulated} of {len(parts)} sessions, in {simulating_s:.0f} s. Analysing all samples …")
    sessions = read_sessions(sorted(part.path for part in parts), jobs=jobs)
    rng = np.random.default_rng(options.seed)
    results = with_limit_curves(analyse(pairs_of(sessions), rng=rng), rng=rng)
    for part in in_words(results, sessions):
        console.print(part)
    rows, verdicts = (pace_row(sessions), *rows_of(results)), verdicts_of(results)
    beside = tables_of(rows, verdicts, results)
    with made_by(command_line("station", "study", samples=options.samples, seed=options.seed, out=options.out)):
        written = write_results(
            results,
            options.out,
            sources=[session.source for session in sessions],
            first=beside,
            notes=notes_of(sessions),
        )
    print("\n".join(written))
    about = {
        "date": f"{datetime.now().astimezone():%Y-%m-%d}",
        "samples": options.samples,
        "seed": options.seed,
        "session_samples": options.session_samples,
        "versions": versions(),
        "sessions_simulated_now": simulated,
        "sessions": len(parts),
        "simulating_s": round(simulating_s, 1),
        "total_s": round(time.perf_counter() - begin, 1),
    }
    write_json(options.out / "study.json", {"version": 1, "about": about, **as_json(rows, verdicts)})
    for table in beside:
        console.print(printed(table))
    console.print(
        f"{simulated} of {len(parts)} sessions simulated now, in {simulating_s:.0f} s; {about['total_s']} s all"
    )
    console.print(f"Numbers: {options.out / 'study.json'}")
    return 0


def _simulate(parts: tuple[Part, ...], folder: Path, *, jobs: int) -> int:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"Expected to write to the folder {folder}, but that failed: {error.strerror}") from error
    needed = BYTES_PER_SAMPLE * sum(part.samples for part in parts if not whole(part))
    if (free := shutil.disk_usage(folder).free) < needed:
        raise UserError(
            f"Expected {needed / 1e9:.1f} GB of room in {folder}, got {free / 1e9:.1f} GB; give another folder with "
            "--out, or fewer --samples"
        )
    done = simulate_all(parts, jobs=jobs, console=Console(stderr=True, highlight=False))
    tidy(folder)
    return done
