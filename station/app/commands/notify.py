"""Sends a trial notification to whom the rig file names under [notify], and says whether it arrived.

A session tells of faults, a full disk, a lost mark, a long outage and its end: station/app/notify/README.md.
"""

from __future__ import annotations

import argparse
import time

from shared.errors import UserError
from station.app import assembly
from station.app.notify.notifier import Notifier

NAME = "notify"
HELP = "send a trial notification to whom the rig file's [notify] names"
EXAMPLE = "station notify --rig rig.toml"
ONE = "the notification did not arrive, with the reason"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("--rig", required=True, help="rig file with a table [notify]")


def run(options: argparse.Namespace) -> int:
    """Sends it; 0 if it arrived."""
    rig = assembly.rig_from(options.rig)
    if not rig.notify.anybody:
        raise UserError(f"{options.rig}: expected a url or a command in [notify], got neither; nobody would be told")
    notifier = Notifier(rig.notify, seconds=time.monotonic)
    text = f"Rig {rig.id}: this is a trial, nothing has happened"
    facts = {"rig": rig.id, "recording": "", "planned": 0, "samples": 0, "fault": "", "trial": True}
    notifier.tell("end", text, time_ns=time.time_ns(), wanted=True, **facts)
    notifier.close()
    if failures := list(notifier.failures()):
        print("\n".join(f"Notify: {failure}" for failure in failures))
        return 1
    print("The trial notification arrived.")
    return 0
