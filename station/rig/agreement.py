"""Compares the rig file of a station with what its camera agent says of its own one."""

from __future__ import annotations

import math
from collections.abc import Iterator

from shared.messages import CameraGeometry
from shared.rig import RigConfig

_ROUNDING = 1e-6
"""The largest relative difference of equal numbers, as both sides convert units: 10 nm of a mark of 10 mm."""


def disagreement(rig: RigConfig, seen: CameraGeometry) -> str:
    """Returns a sentence on what an agent with another rig file has otherwise; empty if nothing differs.

    A calibration replaces the view of the rig file, hence only a nominal view is compared.
    """
    differing = [
        f"{what} {theirs:g} (here {ours:g})"
        for what, theirs, ours in _both(rig, seen)
        if not math.isclose(theirs, ours, rel_tol=_ROUNDING)
    ]
    if not differing:
        return ""
    return (
        f"expected the camera agent to have the station's rig file, its one says {', '.join(differing)}; give both the "
        "same file and start `pi-agent run` again"
    )


def _both(rig: RigConfig, seen: CameraGeometry) -> Iterator[tuple[str, float, float]]:
    """Yields names in the rig file, and their values by the agent and by the station; what nobody says is left out."""
    if seen.marker_side_m:
        yield "[mark] side_mm", 1e3 * seen.marker_side_m, rig.mark.side_mm
        yield "[mark] aspect", seen.marker_aspect, rig.mark.aspect
    if seen.mark_height_m:
        yield "[block] size_m, its height,", seen.mark_height_m, rig.block.size_m[2]
    if seen.source.startswith("nominal") and seen.mm_per_px:
        yield "[camera] px_per_mm", 1.0 / seen.mm_per_px, rig.camera.px_per_mm
        yield "[camera] height_mm", 1e3 * seen.camera_height_m, rig.camera.height_mm
