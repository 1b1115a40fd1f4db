"""Plans the experiment that would tell effects apart, with the number of runs; `station run --plan` takes the plan.

With a recording it is the next experiment of its diagnosis, the very same that `station diagnose` reports. With
--separate the effects have their typical sizes on a typical rig; one effect alone is to be shown at all.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from shared.arguments import seed_of
from shared.config import Table
from shared.errors import UserError
from shared.rig import load_rig
from station.app.commands.diagnose import diagnose_file
from station.app.planned import write_plan
from station.app.planting import effects_meant
from station.diagnosis.next_experiment.plan import separate
from station.diagnosis.result import NextExperiment
from station.physics.catalogue import Catalogue, catalogue_of_table
from station.physics.effect import Effect

NAME = "plan"
HELP = "plan the cheapest experiment that would tell effects apart"
EXAMPLE = "station plan --separate contact_aging,wear"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("file", type=Path, nargs="?", metavar="FILE", help="recording (.mcap) or table to go on from")
    parser.add_argument("--separate", metavar="A,B", help="ids of the effects to tell apart, or of one to confirm")
    parser.add_argument("--rig", type=Path, help="rig file with effects of your own")
    parser.add_argument("--mu", type=float, default=0.4, help="the friction coefficient that is expected")
    parser.add_argument("--seed", type=seed_of, default=1, help="seed of the diagnosis of FILE")
    parser.add_argument("--out", type=Path, metavar="plan.toml", help="where the plan goes; printed without it")


def run(options: argparse.Namespace) -> int:
    """Prints why and how many runs, and writes the plan; 0."""
    if (options.file is None) == (options.separate is None):
        raise UserError("Expected either a recording or --separate with ids of effects, got both or neither")
    plan = _after(options) if options.file else _between(options)
    if plan is None:
        print("No further experiment is called for.")
        return 0
    print(f"{plan.runs} runs: {plan.why}." if plan.plan else f"{plan.why}.")
    print(f"\n{plan.plan}" if options.out is None else write_plan(plan, options.out))
    return 0


def _after(options: argparse.Namespace) -> NextExperiment | None:
    return diagnose_file(options.file, rig=options.rig, seed=options.seed).diagnosis.next_experiment


def _between(options: argparse.Namespace) -> NextExperiment:
    if not 0.0 < options.mu < 5.0:
        raise UserError(f"Expected a friction coefficient between 0 and 5 after --mu, got {options.mu:g}")
    known = catalogue_of_table(load_rig(options.rig).physics if options.rig else Table({}))
    return separate(chosen(options.separate, known), known, mu_s=options.mu)


def chosen(text: str, known: Catalogue) -> Sequence[Effect]:
    """Returns the effects of a list of ids, each once.

    Raises:
        UserError: for an unknown id, an effect of a simulator's numerics, or no id at all.
    """
    names = list(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    if not names:
        raise UserError("Expected ids of effects after --separate, such as contact_aging,wear, got none")
    for name in names:
        if name not in known:
            raise UserError(f"Expected ids of effects after --separate, got '{name}'{effects_meant(name, known)}")
        if known[name].layer == "numerics":
            raise UserError(
                f"Expected effects that a recording can show after --separate, got '{name}', which is the simulator's "
                "own: refine the simulation instead"
            )
    return [known[name] for name in names]
