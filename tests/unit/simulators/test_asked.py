"""A contact that works out its dearer fields when they are asked for."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from station.physics.contact import Contact
from station.physics.model import Model
from station.simulators.planar.asked import Asked
from station.simulators.planar.commands import ramps
from station.simulators.planar.load import Motion, World
from station.simulators.planar.plate import gravity_at


def some_contact() -> Contact:
    """Two blocks on a slope of 0.2 rad towards +y, as the simulator tells effects of them."""
    commands = ramps([0.0, 2.0], [0.0, 0.4], downhill_rad=np.full(2, np.pi / 2), border_m=0.08)
    world = World(commands, Model(mu_s=0.4), friction=np.ones(2), shake=np.zeros(2))
    blocks = world.blocks(np.arange(2), np.zeros(2, dtype=np.intp), rest_from_s=np.array([-3.0, -5.0]))
    zero, now = np.zeros(2), np.ones(2)
    return world.contact(blocks, now, Motion(zero, zero, zero, zero, zero), gravity_at(blocks.stretch, now))


def test_every_field_is_there() -> None:
    contact = some_contact()
    assert {spec.name: len(getattr(contact, spec.name)) for spec in fields(Contact)} == dict.fromkeys(
        [spec.name for spec in fields(Contact)], 2
    )
    assert contact.tilt_rad == pytest.approx([0.2, 0.2])
    assert contact.down_rad == pytest.approx([np.pi / 2] * 2)
    assert contact.rest_s == pytest.approx([4.0, 6.0])
    assert contact.slid_s == pytest.approx([0.0, 0.0])
    assert contact.step_s == pytest.approx([1.0, 1.0])
    assert contact.border_m == pytest.approx([0.08 - np.hypot(0.005, 0.005)] * 2)


def test_a_field_is_worked_out_once_and_only_when_asked_for() -> None:
    asked: list[int] = []

    def tilt() -> np.ndarray:
        asked.append(1)
        return np.zeros(3)

    contact = Asked.of({"run": np.arange(3.0)}, {"tilt_rad": tilt})
    assert (len(contact), asked) == (3, [])
    assert contact.tilt_rad is contact.tilt_rad
    assert asked == [1]


def test_one_like_another_differs_in_what_was_changed() -> None:
    contact = some_contact()
    turned = Asked.like(contact, way_rad=np.array([1.0, 2.0]))
    assert turned.way_rad.tolist() == [1.0, 2.0]
    assert turned.tilt_rad is contact.tilt_rad
    copied = replace(turned, yaw_rad=np.array([0.5, 0.6]))
    assert copied.way_rad.tolist() == [1.0, 2.0]
    assert copied.yaw_rad.tolist() == [0.5, 0.6]
    assert copied.rest_s is contact.rest_s


def test_what_no_contact_has_is_an_error() -> None:
    with pytest.raises(AttributeError, match="colour"):
        _ = some_contact().colour  # pyright: ignore[reportAttributeAccessIssue]: that is the test
