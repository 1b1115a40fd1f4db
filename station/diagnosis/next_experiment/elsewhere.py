"""The next experiment for friction that was not measured on a tilting plate: no plan of `station run` makes it.

It is computed from the settings that the rows had. What was measured already is never proposed: the same settings come
in another order, reach farther than they did, or are measured more often.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.result import EffectFound, NextExperiment, Value, read_name
from station.diagnosis.search.advised import advice
from station.diagnosis.search.coinciding import Coinciding
from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family

TITLES = {
    "mass_kg": "loads",
    "rest_s": "dwells",
    "temperature_c": "temperatures",
    "relative_humidity": "humidities",
}
"""The settings that may have run together, in words."""

AFRESH = (
    "a fresh specimen after half of the rows, at the same settings: wear begins anew, a drift of the apparatus goes on"
)
TIMES = 4
"""The factor on the number of rows that halves a standard error."""


@dataclass(frozen=True, eq=False)
class Setting:
    """A quantity that an apparatus sets, with its plural, its unit, and its values in n contacts."""

    words: str
    unit: str
    values: Callable[[Contact], Array]


SETTINGS: Mapping[Family, Setting] = {
    "speed law": Setting("sliding speeds", "m/s", lambda contact: contact.speed_m_s),
    "load": Setting("loads", "N", lambda contact: contact.mass_kg * contact.pressing_m_s2),
    "history": Setting("dwells", "s", lambda contact: contact.rest_s),
}
"""The setting on which the effects of a family depend."""


def elsewhere(
    evidence: Evidence,
    effects: Sequence[EffectFound],
    catalogue: Mapping[str, Effect],
    untestable: Mapping[str, str] | None = None,
) -> NextExperiment | None:
    """Returns the experiment that separates the main finding from what looks like it, or measures it better; or None.

    Args:
        evidence: what was measured.
        effects: the findings, of which only a claimed one calls for an experiment.
        catalogue: the effects that were considered.
        untestable: those that the recording could not show, with the reasons.
    """
    claimed = [one for one in effects if one.verdict != "not supported" and set(one.class_ids) & catalogue.keys()]
    contact = evidence.contact()
    if not claimed or contact is None:
        return None
    main = max(claimed, key=lambda effect: effect.probability)
    members = [catalogue[name] for name in main.class_ids if name in catalogue]
    alike = tuple(_alike(members, catalogue, untestable or {}))
    if words := _tied(evidence, contact, members):
        # An effect that could not show at these settings cannot at the same ones either: only the order is a rival.
        return _separates(evidence, f"the same {words} in random order", members, (), else_="the order of measuring")
    if not np.ptp(contact.run) and (words := _words(contact, members)):
        why = f"the same {words} in random order, with a column run or time, without which no drift is seen: it"
        return _separates(evidence, why, members, ("wear",) if "wear" in catalogue else ())
    if len(members) + len(alike) > 1:
        why = "; ".join(_farther(evidence, contact, members))
        return _separates(evidence, why, members, alike) if why else None
    if members[0].family == "drift":
        return NextExperiment(separates=((main.id,),), plan="", runs=evidence.used(), why=AFRESH)
    return _narrows(evidence, main)


def _alike(members: Sequence[Effect], catalogue: Mapping[str, Effect], untestable: Mapping[str, str]) -> Iterator[str]:
    """Yields the effects that look like the members, depend on the same setting, and could not be tested yet."""
    names = {name for effect in members for name in effect.confounded_with} & untestable.keys() & catalogue.keys()
    families = {effect.family for effect in members} & SETTINGS.keys()
    yield from sorted(name for name in names if catalogue[name].family in families)


def _tied(evidence: Evidence, contact: Contact, members: Sequence[Effect]) -> str:
    """Gives the settings that went in one order or with each other, if a member depends on one of them; else empty."""
    coinciding = Coinciding.among(evidence, members)
    titles = set[str]()
    if {coinciding.of.get(effect.id, "") for effect in members} & coinciding.together:
        titles = {TITLES[name] for name in coinciding.together if name != "run"}
    titles |= {one.words for one in _set(contact, members) if _in_one_order(one.values(contact), contact.run)}
    return " and ".join(sorted(titles))


def _set(contact: Contact, members: Sequence[Effect]) -> list[Setting]:
    """Returns the settings of the members' families that varied."""
    families = {effect.family for effect in members}
    settings = (setting for family, setting in SETTINGS.items() if family in families)
    return [one for one in settings if np.ptp(one.values(contact)) > 0]


def _words(contact: Contact, members: Sequence[Effect]) -> str:
    return " and ".join(one.words for one in _set(contact, members))


def _in_one_order(values: Array, run: Array) -> bool:
    """Returns true if the values rose, or fell, all the time."""
    if not np.ptp(run):
        return False
    steps = np.diff(values[np.argsort(run, kind="stable")])
    return bool((steps >= 0).all() or (steps <= 0).all())


def _farther(evidence: Evidence, contact: Contact, members: Sequence[Effect]) -> Iterator[str]:
    """Yields wider ranges of the settings that the members depend on.

    Where there are none, it yields what the members advise.
    """
    settings = _set(contact, members)
    for one in settings:
        low, high = float(np.min(one.values(contact))), float(np.max(one.values(contact)))
        yield f"{one.words} over a wider range than {low:.3g} to {high:.3g} {one.unit}, in random order"
    if not settings:
        yield from dict.fromkeys(filter(None, (advice(evidence, effect) for effect in members)))


def _separates(
    evidence: Evidence, why: str, members: Sequence[Effect], alike: Sequence[str], *, else_: str = ""
) -> NextExperiment:
    """Returns the advice that separates the members from each other and from what is `alike`.

    One that stands alone is told from a change with something `else_`.
    """
    rivals = tuple(dict.fromkeys((*(effect.id for effect in members), *alike)))
    first, *others = rivals
    alone = f"tells {first} from a change with {else_}" if else_ else f"shows if it is {first}"
    aim = f"tells {first} from {' and '.join(others)}" if others else alone
    return NextExperiment(separates=(rivals,), plan="", runs=evidence.used(), why=f"{why} {aim}")


def _narrows(evidence: Evidence, main: EffectFound) -> NextExperiment | None:
    """Returns more rows of the same kind; None if the number is precise already."""
    known = next(iter(_numbers(main)), None)
    if known is None or known[1].sd <= thresholds.PRECISE * abs(known[1].value):
        return None
    name, value = known
    what = "groups" if evidence.group is not None else "rows"
    sd = value.sd / math.sqrt(TIMES)
    why = f"{TIMES} times as many {what} of this kind measure {main.id}'s {name} to {value.sharper(sd)}"
    return NextExperiment(separates=((main.id,),), plan="", runs=TIMES * evidence.used(), why=why, sd=sd)


def _numbers(main: EffectFound) -> Iterator[tuple[str, Value]]:
    """Yields the numbers that are known, the combinations of several first."""
    yield from ((one.expression, one.known) for one in main.determined if math.isfinite(one.sd))
    sure = ((name, one) for name, one in main.parameters.items() if math.isfinite(one.sd) and not one.at_bound)
    yield from ((read_name(name, one.unit), one) for name, one in sure)
