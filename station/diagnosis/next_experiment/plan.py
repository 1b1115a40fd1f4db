"""The next experiment: the plan that would settle what a recording leaves open, and what it promises.

A finding with rivals is told from them; one that stands alone has its number measured twice as well; a suspicion is
confirmed. The report, `station diagnose --plan` and `station plan` all ask here.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import tomli_w

from station.diagnosis import thresholds
from station.diagnosis.likelihood.systematic import without_nuisances
from station.diagnosis.next_experiment.changes import FREE, Changes
from station.diagnosis.next_experiment.choice import POWER, Bench, Choice, narrowing, separating
from station.diagnosis.next_experiment.likely_values import likely_values
from station.diagnosis.next_experiment.on_paper import NOISE, RUNS, on_paper, standard
from station.diagnosis.next_experiment.open_shapes import open_shapes
from station.diagnosis.next_experiment.outlook import OTHER, Question, Rival
from station.diagnosis.next_experiment.redone import Draw, Recorded
from station.diagnosis.next_experiment.words import by_hand, in_words
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.result import EffectFound, NextExperiment, Value, read_name
from station.diagnosis.search.candidates import Candidate
from station.diagnosis.search.search import Search
from station.physics.effect import Effect
from station.physics.model import Model, Term

USUAL_RUNS = 200
HALF = 0.5
"""A number that stands alone is to be known twice as well."""

CHOSEN = 2.0
"""A plan has a range of dwells if one in twenty was so many times another. A plan of one dwell of 0.5 s has dwells from
0.61 to 0.62 s in simulated time, and up to 0.70 s live, as a run waits for frames before it tilts."""
NO_PLAN = "No single plan separates them"
GENERAL = "In general, which was not tried for this session, {}"


def next_experiment(
    evidence: Evidence, found: Search, effects: Sequence[EffectFound], catalogue: Mapping[str, Effect]
) -> NextExperiment | None:
    """Returns the plan for the main finding, or else for the strongest suspicion; None if there is neither."""
    bench = _bench(evidence)
    if bench is None:
        return None
    main = _main(found, effects, catalogue)
    if main is not None:
        question = asked(evidence, found, main, catalogue)
        if not question.rivals:
            return None
        if len(question.ids) > 1:
            return _separates(question, bench)
        return narrows(question, bench, main)
    suspicion = _suspicion(found)
    return None if suspicion is None else _confirms(_suspected(found, suspicion, catalogue), bench)


def more_runs() -> NextExperiment:
    """Returns the plan for a recording of which most runs could not be used."""
    return NextExperiment(
        separates=(), plan=_toml((FREE,), USUAL_RUNS), runs=USUAL_RUNS,
        why="too few runs can be used: free azimuths bring the block away from the border, where it leans on the foam",
        changed=("direction",),
    )  # fmt: skip


def separate(
    effects: Sequence[Effect],
    catalogue: Mapping[str, Effect],
    *,
    mu_s: float = 0.4,
    protocol: Draw | None = None,
) -> NextExperiment:
    """Returns the plan that tells effects of typical size apart, or shows one, on a typical rig without a recording.

    `protocol` is that of the session that would be done otherwise: the paper's by default.
    """
    draw = standard(np.random.default_rng(0), RUNS) if protocol is None else protocol
    bench, beside = Bench(recorded=on_paper(draw, mu_s=mu_s)), Model(mu_s=mu_s)
    rivals = (open_shapes(bench.recorded.evidence, beside, Rival(_typical(effect))) for effect in effects)
    question = Question(
        rivals=tuple(one for several in rivals for one in several),
        ids=tuple(effect.id for effect in effects),
        beside=beside,
        noise=NOISE,
        effects=tuple(catalogue.values()),
    )
    return _separates(question, bench) if len(effects) > 1 else _confirms(question, bench)


def _typical(effect: Effect) -> Term:
    """Returns the effect with its first size at a typical value, or at the bound that is nearer."""
    size = next(parameter for parameter in effect.parameters if not parameter.is_shape)
    value = size.clipped(size.neutral + size.typical)
    if value == size.neutral:
        value = size.clipped(size.neutral - size.typical)
    return Term(effect, {**effect.neutral(), size.name: value})


def _bench(evidence: Evidence) -> Bench | None:
    recorded = Recorded.of(evidence)
    return None if recorded is None else Bench(recorded=recorded, usable=len(recorded.runs) / evidence.total_runs)


def _main(found: Search, effects: Sequence[EffectFound], catalogue: Mapping[str, Effect]) -> EffectFound | None:
    """Returns the claimed name of the catalogue that gains most."""
    named = [one for one in effects if one.id in found.compared and set(one.class_ids) & catalogue.keys()]
    claimed = [one for one in named if one.verdict in ("supported", "indistinguishable")]
    return max(claimed, key=lambda one: found.compared[one.id].candidates[0].twice_gain, default=None)


def asked(evidence: Evidence, found: Search, main: EffectFound, catalogue: Mapping[str, Effect]) -> Question:
    """Returns the question which member of a class is true: each at likely values, with its share of the posterior."""
    comparison = found.compared[main.id]
    shares, beside = comparison.shares(), without_nuisances(comparison.without.model)
    fitted = {one.ids[0]: one for one in comparison.candidates if one.fitted is not None}
    names = [name for name in main.class_ids if name in fitted and name != OTHER]
    rivals = (one for name in names for one in _likely(fitted[name], shares[name]))
    return Question(
        rivals=tuple(one for rival in rivals for one in open_shapes(evidence, beside, rival)),
        ids=tuple(main.class_ids),
        beside=beside,
        noise=found.model.noise,
        effects=tuple(catalogue.values()),
    )


def _likely(candidate: Candidate, weight: float) -> Iterable[Rival]:
    """Returns a fitted candidate as a rival, at several values that its fit leaves likely."""
    fitted, (effect,) = candidate.fitted, candidate.effects
    assert fitted is not None
    term = next(term for term in fitted.model.terms if term.effect.id == effect.id)
    return likely_values(fitted, Rival(term, weight))


def _suspicion(found: Search) -> Term | None:
    """Returns the best single effect of the last stage at its promised size.

    It is None if the best of so many is so by chance.
    """
    last = found.stages[-1]
    if last.chosen is not None or found.compared:
        return None
    singles = [one for one in last.candidates if len(one.effects) == 1 and not one.smooth and one.starts]
    best = max(singles, key=lambda one: one.bic, default=None)
    by_chance = 1.0 if best is None else last.calibration.corrected(best.p)
    return None if best is None or by_chance > thresholds.EVEN else best.starts[0]


def _suspected(found: Search, suspicion: Term, catalogue: Mapping[str, Effect]) -> Question:
    return Question(
        rivals=(Rival(suspicion),),
        ids=(suspicion.effect.id,),
        beside=without_nuisances(found.model.model),
        noise=found.model.noise,
        effects=tuple(catalogue.values()),
    )


def _separates(question: Question, bench: Bench) -> NextExperiment:
    choice = separating(question, bench)
    if choice.promise.power < POWER:
        return _none(question, choice, bench, NO_PLAN, advice=GENERAL.format("they are separated by"))
    first, *others = (" or ".join(group) for group in choice.groups)
    return _promised(
        tuple(name for group in choice.groups for name in group),
        choice,
        bench,
        f"tells {first} from {' and '.join(others)}",
    )


def _confirms(question: Question, bench: Bench) -> NextExperiment:
    choice = separating(question, bench)
    (name,) = question.ids
    if choice.promise.power < POWER:
        words = f"No single plan shows {name} of this size"
        return _none(question, choice, bench, words, advice=GENERAL.format("it is shown by"))
    return _promised((name, "none"), choice, bench, f"shows {name}, if it is there,")


def _promised(ids: tuple[str, ...], choice: Choice, bench: Bench, aim: str) -> NextExperiment:
    promise = choice.promise
    promised = f"{aim} with a probability of {promise.power:.2f} (about {choice.minutes:.0f} min)"
    return NextExperiment(
        separates=(ids,),
        plan=_toml(choice.changes, choice.runs, bench),
        runs=choice.runs,
        why=f"{_words(choice.changes, bench)} {promised}",
        power=promise.power,
        log_odds=promise.log_odds,
        minutes=choice.minutes,
        changed=_tables(choice.changes),
        tells_apart=tuple(tuple(group) for group in choice.groups),
    )


def _none(question: Question, choice: Choice, bench: Bench, words: str, *, advice: str) -> NextExperiment:
    """Returns no plan: what the most promising one would do, and what the effects themselves advise."""
    reasons = dict.fromkeys(rival.term.effect.separated_by for rival in question.rivals)
    return NextExperiment(
        separates=(question.ids,), plan="", runs=0, power=choice.promise.power,
        why=f"{words}. {most_promising(choice, bench)} {advice} {'; or by '.join(reasons)}",
    )  # fmt: skip


def most_promising(choice: Choice, bench: Bench) -> str:
    """Returns the sentence on the best of the plans that fall short of POWER."""
    percent = round(100.0 * choice.promise.power)
    if not percent:
        return "None of those that were tried would do so in even 1 % of the sessions."
    return f"The most promising one ({_words(choice.changes, bench)}) would do so in {percent} % of the sessions."


def narrows(question: Question, bench: Bench, main: EffectFound) -> NextExperiment | None:
    """Returns the plan that halves the standard error of a reported size; None if it is precise already."""
    rival = question.rivals[0]
    name, value = _number(rival.term.effect, main.parameters)
    if value is None or value.sd <= thresholds.PRECISE * _size(rival.term.effect, main.parameters, name):
        return None
    choice = narrowing(question, bench, ratio=HALF)
    if choice is None:
        return None
    sd = choice.sd_ratio * value.sd
    why = (
        f"{_words(choice.changes, bench)}: this measures {rival.id}'s {read_name(name, value.unit)} to "
        f"{value.sharper(sd)} (about {choice.minutes:.0f} min)"
    )
    return NextExperiment(
        separates=((rival.id,),), plan=_toml(choice.changes, choice.runs, bench), runs=choice.runs, why=why,
        minutes=choice.minutes, sd=sd, changed=_tables(choice.changes),
    )  # fmt: skip


def _number(effect: Effect, values: Mapping[str, Value]) -> tuple[str, Value | None]:
    """Returns the name of an effect's largest size by typical sizes, and its value."""
    sizes = [
        parameter
        for parameter in effect.parameters
        if not parameter.is_shape and math.isfinite(values[parameter.name].sd) and not values[parameter.name].at_bound
    ]
    if not sizes:
        return "", None
    largest = max(sizes, key=lambda one: abs(values[one.name].value) / one.typical)
    return largest.name, values[largest.name]


def _size(effect: Effect, values: Mapping[str, Value], name: str) -> float:
    """Returns the size of a number, or of the vector that it is a component of.

    Components have the same unit, typical size and bounds, and their bounds are symmetric about 0.
    """
    kinds = {p.name: (p.unit, p.low, p.high, p.typical) for p in effect.parameters}
    like = [other for other, kind in kinds.items() if kind == kinds[name] and kind[1] == -kind[2]] or [name]
    return math.hypot(*(values[other].value for other in like))


def _words(changes: Changes, bench: Bench | None) -> str:
    if bench is None:
        return in_words(changes, None, dwells=False)
    return in_words(changes, bench.recorded.protocol(), dwells=bool(dwells_of(bench)))


def _toml(changes: Changes, runs: int, bench: Bench | None = None) -> str:
    """Returns a plan file with what is changed; what it does not name stays at its default, or as recorded."""
    known = None if bench is None else bench.recorded.protocol()
    lines = [f"# {_words(changes, bench)}", *(f"# by hand: {said}" for said in by_hand(changes, known))]
    tables: dict[str, object] = {"samples": runs, **(dwells_of(bench) if bench else {})}
    for change in changes:
        tables |= {name: dict(table) for name, table in change.tables.items()}
    return "\n".join(lines) + "\n" + tomli_w.dumps(tables)


def _tables(changes: Changes) -> tuple[str, ...]:
    return tuple(name for change in changes for name in change.tables)


def dwells_of(bench: Bench) -> dict[str, dict[str, float]]:
    """Returns the recorded range of dwells for a recording that has no plan file, if they varied."""
    low, high = (float(value) for value in np.quantile(bench.recorded.protocol()["dwell_s"], (0.05, 0.95)))
    return {"dwell": {"min_s": round(low, 2), "max_s": round(high, 2)}} if high > CHOSEN * low else {}
