"""Makes session.mcap anew: `python -m tests.golden.make`. Do that only when a decision is meant to change."""

import argparse
import tempfile
from pathlib import Path

from station.app.commands import run as command
from station.recording.repair import copy_without
from station.sampling.machine import INPUTS
from station.sampling.replay import DECISIONS

HERE = Path(__file__).parent
SESSION = HERE / "session.mcap"


def main() -> None:
    """Runs the plan in lockstep and keeps what the state machine heard and decided."""
    with tempfile.TemporaryDirectory() as folder:
        whole = Path(folder) / "whole.mcap"
        parser = argparse.ArgumentParser()
        command.add_arguments(parser)
        command.run(parser.parse_args(["--lockstep", "--plan", str(HERE / "plan.toml"), "--out", str(whole)]))
        SESSION.unlink(missing_ok=True)
        copy_without(whole, SESSION, drop=lambda topic: topic not in {*INPUTS, *DECISIONS})


if __name__ == "__main__":
    main()
