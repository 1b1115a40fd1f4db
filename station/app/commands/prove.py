"""Says where the proof of the diagnosis is: it belongs to the checkout, not to what is installed."""

from __future__ import annotations

import argparse
from pathlib import Path

NAME = "prove"
HELP = "say how to prove the diagnosis on recordings with concealed effects"
EXAMPLE = "station prove"
ROOT = Path(__file__).resolve().parents[3]


def add_arguments(_parser: argparse.ArgumentParser) -> None:
    """Declares no option."""


def run(_options: argparse.Namespace) -> int:
    """Prints the line."""
    here = (ROOT / "tests" / "proof").is_dir()
    where = str(ROOT) if here else "a checkout of the repository, of which this installation has no part"
    print(f"The proof runs by `make proof` (minutes) or `make proof-full` (hours), in {where}")
    return 0
