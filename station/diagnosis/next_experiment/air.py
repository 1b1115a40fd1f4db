"""The next experiment where the air changed with the runs: no plan sets it, so what was done is done in other air."""

from __future__ import annotations

from collections.abc import Sequence

from station.diagnosis.result import EffectFound, NextExperiment
from station.diagnosis.search.search import Search

AIR = {"temperature_c": ("temperature", "temperatures"), "relative_humidity": ("humidity", "humidities")}
"""The fields of the air in words, one and several."""


def in_other_air(found: Search, effects: Sequence[EffectFound]) -> NextExperiment | None:
    """Returns the same in random order of the air, or while it changes otherwise, if air and order went together."""
    coinciding = found.fitter.coinciding
    air = [AIR[field] for field in AIR if field in coinciding.together]
    main = next((one for one in effects if one.verdict == "indistinguishable" and "other" in one.class_ids), None)
    if main is None or not air or "run" not in {coinciding.of.get(name) for name in main.class_ids}:
        return None
    first, *others = main.members
    one, several = (" and ".join(words) for words in zip(*air, strict=True))
    why = (
        f"the same {several} in random order, or the same again while the {one} holds or goes the other way, "
        f"tells {first} from {' and '.join(others)}"
    )
    return NextExperiment(separates=(main.class_ids,), plan="", runs=found.fitter.evidence.used(), why=why)
