"""The TOML files that a recording carries.

They are a stranger's data: recordings are passed on. Nothing in them makes anything load or run; effects, importers and
simulators of one's own are loaded from folders that one's own rig file or the command line names, and from no others.
"""

from __future__ import annotations

import contextlib
import math
from dataclasses import replace

from shared.config import Table, table_of
from shared.errors import UserError
from shared.geometry import mark_scale
from shared.messages import CameraGeometry
from shared.rig import RigConfig, rig_of_table
from shared.visible import visible
from station.recording.reader import RecordingReader

SIMULATED_FROM = "simulated_from"
"""The key in a session's metadata under which one that was simulated again names the recorded one."""

TOLD_AT_DEG = 20.0
"""The tilt, degrees, at which a sag is told: near it the steel block of the simulated rig begins to slide."""

_NO_SAG_PX = 1e6
"""Pixels from which on a number in a stranger's file is no sag: no picture is as wide."""


def attached_table(reader: RecordingReader, name: str) -> Table | None:
    """Returns the TOML file `name` inside a recording; None if it carries none.

    Raises:
        UserError: if it is not TOML.
    """
    if name not in reader.attachments:
        return None
    return table_of(reader.attachments[name], f"{name} in {reader.path}")


def attached_rig(reader: RecordingReader) -> RigConfig | None:
    """Returns the rig inside a recording, without the folders of effects and plug-ins that it names.

    It is None if it carries none.

    A session that was simulated again has nothing of what a simulated rig conceals on purpose.

    Raises:
        UserError: if it is not a rig file.
    """
    table = attached_table(reader, "rig.toml")
    if table is None:
        return None
    rig = replace(rig_of_table(table), physics=Table({}), plugins=Table({}))
    return replace(rig, planted="") if SIMULATED_FROM in reader.metadata.get("session", {}) else rig


def planted_in(rig: RigConfig | None) -> tuple[str, ...]:
    """Returns a note on what a simulated rig conceals on purpose, if its file says so."""
    if rig is None or not rig.planted:
        return ()
    return (f"the rig is a simulation: {visible(rig.planted)}{_sag_at_onset(rig)}",)


def _sag_at_onset(rig: RigConfig) -> str:
    """Returns the sag of a simulated camera in px and in mm, at a tilt that is reached; empty if it does not sag.

    The mm are those at the height of the block's mark, in which a diagnosis tells it: that is nearer to the lens.
    """
    camera = rig.camera
    upright_px = camera.options.values.get("sag_px")
    if not isinstance(upright_px, int | float) or not 0.0 < abs(upright_px) < _NO_SAG_PX:
        return ""
    shift_px = upright_px * math.sin(math.radians(TOLD_AT_DEG))
    view = CameraGeometry(mark_height_m=rig.block.size_m[2], camera_height_m=1e-3 * camera.height_mm)
    at_mark = f"{mark_scale(view) * shift_px / camera.px_per_mm:.2f} mm at the height of the block's mark"
    return f" (at {TOLD_AT_DEG:g}° the picture moves by {shift_px:.1f} px, {at_mark})"


def planted_in_recording(reader: RecordingReader) -> tuple[str, ...]:
    """Returns the same note about the rig inside a recording; none if that cannot be read."""
    with contextlib.suppress(UserError):
        return planted_in(attached_rig(reader))
    return ()


def effects_left_out(reader: RecordingReader) -> tuple[str, ...]:
    """Returns the folders of effects that the rig file inside a recording would load if it were one's own, by name.

    Raises:
        UserError: if it is not TOML, or its `[physics]` is no table.
    """
    table = attached_table(reader, "rig.toml")
    named = table.child("physics").values.get("effects", ()) if table else ()
    return tuple(str(name) for name in named) if isinstance(named, list) else ()
