"""Messages made quickly are the messages that `dataclass` alone would make."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle

import pytest

from shared.foxglove import FrameTransform, Vector3
from shared.frozen import quicken
from shared.messages import MarkerCorners, PlatformState

STATE = PlatformState(7, 0.5, qz=0.25, frame_id="world")


def test_defaults_positions_and_names_are_those_of_the_class():
    assert dataclasses.astuple(STATE) == (7, 0.5, 0.0, 0.0, 0.25, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, "world")
    assert FrameTransform().translation == Vector3()
    assert list(inspect.signature(MarkerCorners).parameters) == [
        spec.name for spec in dataclasses.fields(MarkerCorners)
    ]


def test_it_stays_frozen():
    with pytest.raises(dataclasses.FrozenInstanceError):
        STATE.qw = 1.0  # pyright: ignore[reportAttributeAccessIssue]
    with pytest.raises(TypeError, match="speed"):
        PlatformState(speed=1.0)  # pyright: ignore[reportCallIssue]


def test_copies_are_equal():
    assert pickle.loads(pickle.dumps(STATE)) == copy.deepcopy(STATE) == dataclasses.replace(STATE) == STATE
    assert dataclasses.replace(STATE, qw=1.0) != STATE


def test_a_field_without_a_default_must_be_given():
    @dataclasses.dataclass(frozen=True, slots=True)
    class Needs:
        value: int
        unit: str = "m"

    quicken(Needs)
    assert Needs(3) == Needs(value=3, unit="m")
    with pytest.raises(TypeError, match="value"):
        Needs()  # pyright: ignore[reportCallIssue]


@dataclasses.dataclass(frozen=True, slots=True)
class Makes:
    values: list[int] = dataclasses.field(default_factory=list[int])


@dataclasses.dataclass(frozen=True, slots=True)
class Checks:
    value: int = 0

    def __post_init__(self) -> None:
        assert self.value >= 0


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Names:
    value: int = 0


@pytest.mark.parametrize("cls", [Makes, Checks, Names])
def test_a_class_that_does_more_than_hold_fields_is_refused(cls: type):
    with pytest.raises(TypeError, match=cls.__name__):
        quicken(cls)
