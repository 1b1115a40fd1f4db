"""Shows the diagnosis at work: a session with a concealed effect, its diagnosis, the reveal, and the report.

The effect is drawn at random, or planted with --effect. What was drawn is sealed: the hash of the key file is printed
before the session is simulated, and the diagnosis gets the recording alone. Right or wrong, it is said.
"""

from __future__ import annotations

import argparse
import secrets
from pathlib import Path

import numpy as np
from rich.console import Console

from shared.arguments import seed_of
from shared.config import Table
from shared.errors import UserError
from shared.programs import how_to_call
from station.app.demonstration import PLAIN, conceal, drawn, reveal, seal
from station.app.diagnosing import diagnose_file
from station.app.one_run import run_in_motion
from station.app.planting import plant
from station.app.progress import stages
from station.diagnosis.report.page import html_page
from station.diagnosis.report.summary import summary
from station.pages.caption import command_line, made_by
from station.physics.catalogue import catalogue_of_table
from station.physics.model import Model

NAME = "demo"
HELP = "conceal an effect in a simulated session, diagnose it, and reveal what it was"
EXAMPLE = "station demo --effect kinetic_drop=0.3"
ONE = "the concealed effect was not named"
SAMPLES = 60
"""Runs of the session: enough for strong effects, and half a minute of simulation on two cores."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument(
        "--effect",
        action="append",
        default=[],
        metavar="ID=VALUE",
        help="conceal this instead of a random one; ID.PARAMETER=VALUE for a further parameter of it",
    )
    parser.add_argument("--samples", type=int, default=SAMPLES, help="how many runs")
    parser.add_argument(
        "--seed", type=seed_of, help="seed of every random choice; without it a new one, which is printed"
    )
    parser.add_argument("--out", type=Path, default=Path("demo"), metavar="FOLDER", help="where everything goes")


def run(options: argparse.Namespace) -> int:
    """Conceals, diagnoses, reveals; 0 if the effect was named."""
    known = catalogue_of_table(Table({}))
    seed = secrets.randbelow(2**31) if options.seed is None else options.seed
    model = plant(options.effect, PLAIN, known) if options.effect else drawn(known, np.random.default_rng(seed))
    if len(model.terms) != 1:
        raise UserError(f"Expected one effect after --effect, got {len(model.terms)}")
    folder = _new_folder(options.out, seed)
    console = Console(highlight=False, soft_wrap=True)
    console.print(f"A session of {options.samples} runs with a concealed effect (seed {seed})")
    rng = np.random.default_rng(seed)
    sealed = seal(model, folder, rng)
    console.print(f"Sealed: {sealed.key}, sha256 {sealed.sha256}")
    with stages(console, "simulating the session") as show:
        concealed = conceal(
            model,
            folder,
            rng,
            samples=options.samples,
            seed=seed,
            on_sample=lambda count: show(f"simulating the session: {count} of {options.samples} runs"),
        )
        session = concealed.recording
        examined = diagnose_file(session, status=show)
        show("writing the report")
        report = folder / "report.html"
        with made_by(command_line("station", "diagnose", session, report=report)):
            motion = run_in_motion(session, examined.diagnosis)
            page = html_page(examined.diagnosis, examined.pictures, motion=motion)
        report.write_text(page, encoding="utf-8")
    console.print(summary(examined.diagnosis))
    console.print()
    revealed = reveal(model, examined.diagnosis, known, shows=concealed.shows)
    for line in revealed.lines:
        console.print(line, markup=False)
    _next_steps(console, model, report, session)
    return 0 if revealed.right else 1


def _new_folder(out: Path, seed: int) -> Path:
    """Returns the folder of this demonstration, of which there may be many: named by its seed."""
    folder = out / str(seed)
    try:
        folder.mkdir(parents=True)
    except FileExistsError:
        raise UserError(
            f"Expected a new demonstration, but {folder} is there; choose another --seed or --out"
        ) from None
    except OSError as error:
        raise UserError(f"Expected to write to {folder}, but that failed: {error.strerror}") from error
    return folder


def _next_steps(console: Console, model: Model, report: Path, recording: Path) -> None:
    station = how_to_call("station")
    (term,) = model.terms
    console.print(f"\nOpen the report:        {report}")
    console.print(f"See the session:        {station} replay {recording}")
    console.print(f"What the effect is:     {station} effects {term.effect.id}")
    console.print(f"Conceal another one:    {station} demo")
