"""Contacts with other fields forget what follows from these, and keep all else that was worked out."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cached_property

import numpy as np
import pytest

from station.physics.contact import Contact
from tests.contracts.effect_states import contacts

WORKED_OUT = tuple(name for name, each in vars(Contact).items() if isinstance(each, cached_property))


@pytest.mark.parametrize("name", [one.name for one in fields(Contact)])
def test_a_contact_with_another_field_is_as_if_made_anew(name: str) -> None:
    known = contacts()
    for each in WORKED_OUT:
        getattr(known, each)
    other = np.asarray(getattr(known, name))[::-1]
    changed, anew = known.changed(**{name: other}), replace(known, **{name: other})
    for each in (*(one.name for one in fields(Contact)), *WORKED_OUT):
        np.testing.assert_array_equal(getattr(changed, each), getattr(anew, each))
