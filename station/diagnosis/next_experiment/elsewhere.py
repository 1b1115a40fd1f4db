"""The next experiment for friction that was not measured on a tilting plate: no plan of `station run` makes it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.result import EffectFound, NextExperiment
from station.diagnosis.search.advised import advice
from station.diagnosis.search.coinciding import Coinciding
from station.physics.effect import Effect

TITLES = {
    "run": "runs",
    "mass_kg": "loads",
    "rest_s": "dwells",
    "temperature_c": "temperatures",
    "relative_humidity": "humidities",
}
"""The settings that may have run together, in words."""


def elsewhere(
    evidence: Evidence, effects: Sequence[EffectFound], catalogue: Mapping[str, Effect]
) -> NextExperiment | None:
    """The same measurements in another order, or what separates the main finding; None without a finding.

    Where order and cause run together, the same settings in random order separate them in as many runs.
    """
    named = [effect for effect in effects if set(effect.class_ids) & catalogue.keys()]
    if not named:
        return None
    main = max(named, key=lambda effect: effect.probability)
    members = [catalogue[name] for name in main.class_ids if name in catalogue]
    coinciding = Coinciding.among(evidence, members)
    fields = {coinciding.of.get(effect.id, "") for effect in members} & coinciding.together
    settings = [TITLES[name] for name in sorted(fields) if name != "run"]
    if settings:
        why = f"the same {' and '.join(settings)} in random order"
    else:
        why = "; ".join(dict.fromkeys(filter(None, (advice(evidence, effect) for effect in members))))
    alike = members[0].confounded_with if len(members) == 1 else ()
    seen = [name for name in alike if name in catalogue and _can_show(evidence, catalogue[name])]
    rivals = (*(effect.id for effect in members), *seen)
    from_others = f" separates {' from '.join(rivals)}" if len(rivals) > 1 else f", to see {members[0].id}"
    if not why:
        return None
    return NextExperiment(separates=(rivals,), plan="", runs=evidence.used(), why=why + from_others)


def _can_show(evidence: Evidence, effect: Effect) -> bool:
    """True if an effect could change anything that was measured: a tribometer has no lens, and one place alone."""
    contact = evidence.contact()
    if contact is None or effect.why_untestable(contact) is not None:
        return False
    return any(channel.changed_by(effect) for channel in evidence.channels)
