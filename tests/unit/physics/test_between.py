"""A recording has a part that a simulation lacks: both together are the recording."""

from __future__ import annotations

import pickle

import pytest

from station.physics.between import between
from station.physics.catalogue import catalogue
from station.physics.contact import Contact
from station.physics.model import Model, Term
from tests.contracts.effect_states import contacts

KNOWN = catalogue()


def model(mu_s: float, **sizes: float) -> Model:
    made = Model(mu_s=mu_s)
    for name, size in sizes.items():
        effect = KNOWN[name]
        first = next(one for one in effect.parameters if not one.is_shape)
        made = made.with_term(Term(effect, {**effect.neutral(), first.name: size}))
    return made


def states() -> Contact:
    return contacts(40)


@pytest.mark.parametrize(
    ("recording", "simulation"),
    [
        (model(0.35, kinetic_drop=0.2), model(0.25)),
        (model(0.3), model(0.3, contact_aging=0.04)),
        (model(0.3, plate_anisotropy=0.2, viscous=0.1), model(0.4, viscous=0.3, pivot_offset=0.05)),
    ],
)
def test_the_simulation_with_the_difference_is_the_recording(recording: Model, simulation: Model) -> None:
    found, at = between(recording, simulation), states()
    assert simulation.friction(at) * found.friction(at) == pytest.approx(recording.friction(at))
    assert simulation.push(at) + found.push(at) == pytest.approx(recording.push(at))


def test_what_both_have_alike_changes_nothing() -> None:
    same = model(0.3, kinetic_drop=0.2, camera_sag=1e-3)
    found = between(same, same)
    assert found.mu_s == 1.0
    assert not any(found.acting(hook) for hook in ("friction", "push", "seen", "attitude", "delay_s"))


def test_a_late_camera_of_one_of_them_is_a_delay() -> None:
    assert between(model(0.3, clock_offset=0.03), model(0.3)).delay_s() == pytest.approx(0.03)
    assert between(model(0.3), model(0.3, clock_offset=0.03)).delay_s() == pytest.approx(-0.03)


def test_it_can_be_sent_to_another_process() -> None:
    found, at = between(model(0.35, kinetic_drop=0.2), model(0.25)), states()
    assert pickle.loads(pickle.dumps(found)).friction(at) == pytest.approx(found.friction(at))
