"""A calibration as a TOML file beside the rig file."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

from pi_agent.calibration.model import Calibration
from shared.config import load_table, parse


def load_calibration(path: Path) -> Calibration:
    """Reads a calibration.

    Raises:
        UserError: naming file, line and key of what is wrong.
    """
    return parse(Calibration, load_table(path))


def write_calibration(calibration: Calibration, path: Path, *, notes: str = "") -> None:
    """Writes a calibration; `notes` stand above it as comments."""
    lines = [f"# {line}".rstrip() for line in notes.splitlines()]
    for spec in fields(calibration):
        value = getattr(calibration, spec.name)
        text = f'"{value}"' if isinstance(value, str) else str(list(value) if isinstance(value, tuple) else value)
        lines.append(f"{spec.name} = {text}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
