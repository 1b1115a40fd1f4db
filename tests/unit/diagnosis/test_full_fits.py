"""A pair is fitted in full where its scores promise more than one of its effects alone has gained."""

from __future__ import annotations

from station.diagnosis.search.candidates import Candidate
from station.diagnosis.search.full_fits import told_by_one
from station.physics.catalogue import catalogue


class Fitted(Candidate):
    """A candidate with a full fit that is at a maximum."""

    @property
    def credible(self) -> bool:
        return True


class AtBound(Candidate):
    """A candidate whose size ended at a bound."""

    @property
    def credible(self) -> bool:
        return False


def candidate(twice_gain: float, *names: str, kind: type[Candidate] = Candidate) -> Candidate:
    effects = tuple(catalogue()[name] for name in names)
    return kind(effects, (), None, twice_gain, len(names), 0.0, twice_gain, 0.1)


def test_a_pair_whose_strong_half_gains_more_alone_is_not_fitted() -> None:
    """The scores of both say what the strong one alone says, and far too little of it."""
    alone = {("camera_sag",): candidate(10397.5, "camera_sag", kind=Fitted)}
    assert told_by_one(candidate(514.7, "camera_sag", "wear"), alone)


def test_a_pair_that_neither_half_shows_alone_is_fitted() -> None:
    alone = {(name,): candidate(gain, name, kind=Fitted) for name, gain in (("lens_distortion", 2.7), ("wear", 6.0))}
    assert not told_by_one(candidate(40.0, "lens_distortion", "wear"), alone)
    assert not told_by_one(candidate(40.0, "pivot_offset", "stribeck"), alone)


def test_a_pair_whose_strong_half_is_not_credible_alone_is_fitted() -> None:
    """A size at its bound is no answer, and beside another effect it may come inside."""
    alone = {("camera_sag",): candidate(10397.5, "camera_sag", kind=AtBound)}
    assert not told_by_one(candidate(514.7, "camera_sag", "wear"), alone)


def test_a_single_is_fitted() -> None:
    alone = {("wear",): candidate(6.0, "wear", kind=Fitted)}
    assert not told_by_one(candidate(5.0, "wear"), alone)
