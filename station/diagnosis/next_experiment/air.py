"""The next experiment where the air changed with the runs: no plan sets it, so the session is done at another time."""

from __future__ import annotations

from collections.abc import Sequence

from station.diagnosis.result import EffectFound, NextExperiment
from station.diagnosis.search.search import Search

AIR = {"temperature_c": "temperature", "relative_humidity": "humidity"}
"""The fields of the air, in words."""


def in_other_air(found: Search, effects: Sequence[EffectFound]) -> NextExperiment | None:
    """The same session while the air holds or changes the other way, if the air and the order cannot be told apart."""
    coinciding = found.fitter.coinciding
    air = [words for field, words in AIR.items() if field in coinciding.together]
    main = next((one for one in effects if one.verdict == "indistinguishable" and "other" in one.class_ids), None)
    if main is None or not air or "run" not in {coinciding.of.get(name) for name in main.class_ids}:
        return None
    first, *others = main.members
    why = (
        f"the same again while the {' and '.join(air)} holds, or changes the other way, tells {first} from "
        f"{' and '.join(others)}"
    )
    return NextExperiment(separates=(main.class_ids,), plan="", runs=found.fitter.evidence.used(), why=why)
