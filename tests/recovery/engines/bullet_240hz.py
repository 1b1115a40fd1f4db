"""PyBullet at the time step that it has when nobody asks for another."""

from __future__ import annotations

from pathlib import Path

from tests.recovery.engines.bullet import BulletBench

NAME = "Bullet, 240 Hz"
MODULE = "pybullet"
FORMAT = "bullet"
ANISOTROPIC = True


def load(folder: Path, stem: str, *, object_yaw_rad: float = 0.0) -> BulletBench:
    """Runs the exported loader."""
    return BulletBench(folder, stem, object_yaw_rad=object_yaw_rad, step_s=1 / 240)
