"""The next experiment changes what the recording leaves together, and not what it already keeps apart."""

from __future__ import annotations

import numpy as np

from station.diagnosis.next_experiment.on_paper import Bench, Draw, standard
from station.diagnosis.next_experiment.plan import separate
from station.physics.catalogue import catalogue

KNOWN = catalogue()


def falling_dwell(rng: np.random.Generator, runs: int) -> Draw:
    """The standard protocol, each run resting less than the one before: wear and ageing go together."""
    return standard(rng, runs) | {"rest_s": np.geomspace(6.0, 0.3, runs)}


def test_a_plan_undoes_what_the_protocol_ties_together() -> None:
    plan = separate([KNOWN["wear"], KNOWN["contact_aging"]], bench=Bench(protocol=falling_dwell))
    assert "[dwell]" in plan.plan
    assert plan.separates == (("wear", "contact_aging"),)


def test_a_plan_keeps_what_the_protocol_does_well() -> None:
    """Where the block already turns, both grains are apart: nothing needs to be done by hand."""

    def turning(rng: np.random.Generator, runs: int) -> Draw:
        return standard(rng, runs) | {"yaw": rng.uniform(-np.pi, np.pi, runs)}

    rivals = [KNOWN["plate_anisotropy"], KNOWN["object_anisotropy"]]
    assert "by hand" in separate(rivals).plan
    assert "by hand" not in separate(rivals, bench=Bench(protocol=turning)).plan


def test_a_nap_whose_frame_nobody_knows_is_told_from_a_level_error_by_turning_the_plate() -> None:
    """A block that is turned alone tells only the block's nap from it."""
    plan = separate([KNOWN["one_way_friction"], KNOWN["platform_level"]])
    assert "mount" in plan.plan


def test_a_grain_of_the_plate_is_told_from_the_blocks_by_turning_either() -> None:
    plan = separate([KNOWN["plate_anisotropy"], KNOWN["object_anisotropy"]])
    assert "turned" in plan.why
    assert plan.separates == (("plate_anisotropy", "object_anisotropy"),)
