"""The sizes of a rig that evidence needs."""

from __future__ import annotations

from shared.rig import RigConfig
from station.diagnosis.observations.setting import Setting


def setting_of(rig: RigConfig | None) -> Setting:
    """Returns the sizes of plate, block and picture; those of the simulated rig if there is none."""
    if rig is None:
        return Setting()
    return Setting(
        opening_radius_m=0.5 * rig.plate.opening_m,
        opening_outline_m=rig.plate.opening_outline_m,
        block_side_m=rig.block.size_m[0],
        block_mass_kg=rig.block.mass_kg,
        image_height_px=rig.camera.height_px,
    )
