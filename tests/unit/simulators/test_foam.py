"""The foam border: as stiff as it says, and pushed against from the inside only."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from station.simulators.mujoco.engine import BlockEngine
from station.simulators.mujoco.model import Scene, build_block
from station.simulators.mujoco.poses import Pose
from station.simulators.mujoco.specimen import Block, Friction, Plate
from station.simulators.mujoco.world import STEP_S
from tests.unit.simulators.rides import jaco

BLOCK, PLATE = Block(), Plate()
LEVEL = 9.81
DIAGONAL = (math.cos(math.pi / 8), 0.0, 0.0, math.sin(math.pi / 8))


def engine(*, plate: Plate = PLATE) -> BlockEngine:
    """A block on the plate, nearly without friction there."""
    scene = Scene(arm=jaco().stage.model, world_from_base=np.eye(4), block=BLOCK, plate=plate)
    made = BlockEngine(build_block(scene, bordered=True), friction=Friction(mean_angle_rad=0.35))
    made.set_friction(Friction(mean_angle_rad=1e-4).at(1e-4))
    return made


def foam_contacts(block: BlockEngine) -> list[Any]:
    """The contacts of the block's sides."""
    plate = int(block.model.geom("plate").id)
    return [contact for contact in block.data.contact if plate not in contact.geom]


def pressed(block: BlockEngine, pull_m_s2: float, *, quaternion: tuple[float, float, float, float], x_m: float) -> None:
    """Lets the block come to rest in the foam under a pull along x."""
    block.lay(Pose((x_m, 0.0, BLOCK.side_m / 2), quaternion))
    block.step(1500, pull=(pull_m_s2, 0.0, -LEVEL), step_s=STEP_S)


@pytest.mark.parametrize("pull_m_s2", [1.0, 3.0])
def test_a_side_dents_the_foam_by_its_stiffness(pull_m_s2: float) -> None:
    """Two corners touch the segment that the side is parallel to: each carries half of the force."""
    block = engine()
    pressed(block, pull_m_s2, quaternion=(1.0, 0.0, 0.0, 0.0), x_m=0.0395)
    found = foam_contacts(block)
    assert len(found) == 2
    dents_m = [-contact.dist for contact in found]
    force_n = 0.5 * BLOCK.mass_kg * pull_m_s2
    assert force_n / np.mean(dents_m) == pytest.approx(PLATE.foam_stiffness_n_m, rel=0.1)


@pytest.mark.parametrize("stiffness_n_m", [60.0, 3.0])
def test_a_corner_deep_in_the_foam_is_pushed_back_and_not_down(stiffness_n_m: float) -> None:
    """However deep the dent: a push through the foam's lower face would tip the block over the plate's edge."""
    block = engine(plate=Plate(foam_stiffness_n_m=stiffness_n_m))
    pressed(block, 8.5, quaternion=DIAGONAL, x_m=0.038)
    found = foam_contacts(block)
    assert found
    if stiffness_n_m < 10.0:
        assert max(-contact.dist for contact in found) > PLATE.foam_height_m / 2
    assert max(abs(contact.frame[2]) for contact in found) < 0.1
    assert block.pose_after(0.0).lean_rad < 0.05


RECTANGLE = ((-0.03, -0.02), (0.03, -0.02), (0.03, 0.02), (-0.03, 0.02))


@pytest.mark.parametrize("outline", [RECTANGLE, RECTANGLE[::-1]])
@pytest.mark.parametrize(("pull", "reach_m"), [((1.0, 0.0), 0.03), ((0.0, -1.0), 0.02)])
def test_a_block_rests_against_the_side_of_an_opening_with_corners(
    outline: tuple[tuple[float, float], ...], pull: tuple[float, float], reach_m: float
) -> None:
    """Its side is as deep in the foam as two corners' springs say, whichever way round the outline goes."""
    block = engine(plate=Plate(cutout_outline_m=outline))
    start = reach_m - BLOCK.side_m / 2
    block.lay(Pose((start * pull[0], start * pull[1], BLOCK.side_m / 2), (1.0, 0.0, 0.0, 0.0)))
    block.step(1500, pull=(*pull, -LEVEL), step_s=STEP_S)
    x, y, _ = block.pose_after(0.0).position
    assert abs(x * pull[0] + y * pull[1]) + BLOCK.side_m / 2 == pytest.approx(reach_m, abs=2e-4)
    dents_m = [-contact.dist for contact in foam_contacts(block)]
    assert len(dents_m) == 2
    assert np.mean(dents_m) == pytest.approx(0.5 * BLOCK.mass_kg / PLATE.foam_stiffness_n_m, rel=0.1)
