"""A contact whose costly fields are computed when an effect asks for them: hardly any effect asks for all."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields

from station.physics.contact import Array, Bools, Contact

_put = object.__setattr__


class Asked(Contact):
    """Some fields of a `Contact`, and functions that make the others when they are first read."""

    __slots__ = ("_later",)

    _later: Callable[[str], Array | Bools]

    @classmethod
    def of(cls, known: Mapping[str, Array | Bools], later: Mapping[str, Callable[[], Array | Bools]]) -> Asked:
        """Builds it from the fields `known`, and from `later`, the functions that make the rest."""
        return cls._made(known, lambda name: later[name]())

    @classmethod
    def like(cls, other: Contact, **changed: Array | Bools) -> Asked:
        """Returns another contact with some fields changed; `dataclasses.replace` would compute all of them."""
        return cls._made(changed, lambda name: getattr(other, name))

    def facing(self, way_rad: Array) -> Asked:
        """Returns the same contacts with other directions of sliding `way_rad` (n,), rad in P."""
        return Asked.like(self, way_rad=way_rad)

    @classmethod
    def _made(cls, known: Mapping[str, Array | Bools], later: Callable[[str], Array | Bools]) -> Asked:
        made = object.__new__(cls)
        _put(made, "_later", later)
        for name, value in known.items():
            _put(made, name, value)
        return made

    def __getattr__(self, name: str) -> Array | Bools:
        """Computes a field that is not there yet."""
        if name not in _FIELDS:
            raise AttributeError(name)
        value = self._later(name)
        _put(self, name, value)
        return value


_FIELDS = frozenset(spec.name for spec in fields(Contact))
