"""The planar simulator and MuJoCo make the same of every effect that is found, within a stated tolerance.

The two share what acts on a block (gravity, inertial forces, the foam, what the effects say) and nothing of how it
holds, slips, turns and stops. tests/benchmarks/test_simulators_agree.py does this for more runs and sizes.
"""

from __future__ import annotations

import numpy as np
import pytest

from station.physics.catalogue import catalogue
from station.physics.model import Model
from station.simulators.mujoco.batch import simulate as in_mujoco
from station.simulators.mujoco.contact import MUJOCO_DEFAULT
from station.simulators.mujoco.tilted import Setup
from station.simulators.planar.simulate import simulate as in_plane
from tests.contracts.simulated_runs import MU, apart, chances_for, commands_for, stamps_of, tilts, typical

EFFECTS = catalogue()
ONSET_DEG = 0.02
PATH_MM = 0.5
WIDER_DEG = {
    # Its pushes come with the steps of the plate's acceleration, within one time step.
    "pivot_offset": 0.06,
    # Friction that acts far across the way lets a slip begin as a turn: its speed grows otherwise than the reckoning
    # of its beginning has it.
    "uneven_contact": 0.03,
}
WIDER_MM = {
    # The slip is noticed, and its friction lowered, a millisecond or two after it has begun.
    "kinetic_drop": 0.7,
}


@pytest.mark.parametrize("name", EFFECTS)
def test_they_agree_on_each_effect(name: str) -> None:
    commands = commands_for(EFFECTS[name], 3)
    of, chances, stamps = typical(EFFECTS[name]), chances_for(commands), stamps_of(commands)
    found = apart(*(each(commands, of, time_s=stamps, chances=chances) for each in (in_plane, in_mujoco)))
    assert found.length_mm.max() > 2.0, "nothing slid"
    assert np.nanmax(found.onset_deg) < WIDER_DEG.get(name, ONSET_DEG)
    assert found.path_mm.max() < WIDER_MM.get(name, PATH_MM)


def test_they_agree_on_how_friction_far_off_the_mass_turns_the_block() -> None:
    """It swings to and fro by tens of degrees, and slides on the less friction for it."""
    commands = commands_for(EFFECTS["uneven_contact"], 3)
    of, stamps = typical(EFFECTS["uneven_contact"], size=2.0), stamps_of(commands)
    plane, engine = (each(commands, of, time_s=stamps) for each in (in_plane, in_mujoco))
    turned = plane.path[..., 2] - plane.path[:, :1, 2]
    assert np.degrees(np.ptp(turned, axis=1)).max() > 30.0
    assert np.degrees(np.abs(plane.path[..., 2] - engine.path[..., 2])).max() < 10.0
    found = apart(plane, engine)
    assert found.onset_deg.max() < WIDER_DEG["uneven_contact"]
    assert found.path_mm.max() < 2.0 * PATH_MM


def test_what_is_skipped_at_rest_changes_nothing() -> None:
    commands = tilts(3)
    stamps = stamps_of(commands)
    skipped, stepped = (in_mujoco(commands, Model(mu_s=MU), time_s=stamps, share=share) for share in (0.95, 0.0))
    found = apart(skipped, stepped)
    assert found.length_mm.min() > 2.0
    assert found.onset_deg.max() < 0.01
    assert found.path_mm.max() < 0.1


def test_mujocos_defaults_would_fail_it() -> None:
    """The tolerance is one that a simulation with false contact does not pass."""
    commands = tilts(2)
    stamps, plain = stamps_of(commands), Model(mu_s=MU)
    found = apart(
        in_plane(commands, plain, time_s=stamps),
        in_mujoco(commands, plain, time_s=stamps, share=0.5, setup=Setup(contact=MUJOCO_DEFAULT, solid=True)),
    )
    assert found.path_mm.min() > 3.0 * PATH_MM
