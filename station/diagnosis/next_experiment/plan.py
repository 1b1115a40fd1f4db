"""The next experiment: the plan that would separate what this recording cannot, and its number of runs.

Every design is tried on a synthetic session: the candidates' slopes are computed there, and the information that
remains for one while the others and mu are free says how many runs show an effect of its size with 80 % power at 5 %.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from station.diagnosis.inference.columns import scores
from station.diagnosis.inference.fit import as_simulated
from station.diagnosis.next_experiment.on_paper import TRIAL_RUNS, Bench, Draw, Vary, as_recorded, trial
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.result import EffectFound, NextExperiment
from station.diagnosis.search.search import Search
from station.physics.contact import Array
from station.physics.effect import Effect

POWER = 2.8
"""An effect of so many standard errors shows in 80 of 100 experiments at a level of 5 %."""

FEWEST, MOST = 20, 5000
USUAL_RUNS = 200
LAWS = 0.05
"""What is left of an effect below this share of its own information relies on the laws being exact."""

SHOWS = 0.5
"""Another shape counts as showing as well if it has at least this share of the best shape's information."""


@dataclass(frozen=True)
class Design:
    """A design of a session: its plan beside the defaults, what a person must do, and how it changes the protocol."""

    name: str
    plan: str
    by_hand: str
    vary: Vary
    effort: float = 1.0
    """The cost of a run relative to one that needs nobody."""


def _dwell(rng: np.random.Generator, runs: int, draw: Draw) -> None:
    draw["rest_s"] = np.exp(rng.uniform(math.log(1.0), math.log(100.0), runs))


def _free(rng: np.random.Generator, runs: int, draw: Draw) -> None:
    draw["down"] = rng.uniform(-math.pi, math.pi, runs)


def _rates(rng: np.random.Generator, runs: int, draw: Draw) -> None:
    draw["rate"] = np.radians(np.exp(rng.uniform(math.log(1.0), math.log(20.0), runs)))


def _masses(rng: np.random.Generator, runs: int, draw: Draw) -> None:
    draw["mass_kg"] = draw["mass_kg"] * rng.choice([0.5, 1.0, 2.0, 5.0], runs)


def _mount(rng: np.random.Generator, runs: int, draw: Draw) -> None:
    draw["mount"] = rng.choice([0.0, math.pi / 4, math.pi / 2, math.pi], runs)


def _yaw(rng: np.random.Generator, runs: int, draw: Draw) -> None:
    draw["yaw"] = rng.uniform(-math.pi, math.pi, runs)


def _both(rng: np.random.Generator, runs: int, draw: Draw) -> None:
    _mount(rng, runs, draw)
    _yaw(rng, runs, draw)


def _starts(rng: np.random.Generator, runs: int, draw: Draw) -> None:
    draw["x"], draw["y"] = rng.uniform(-0.03, 0.03, runs), rng.uniform(-0.03, 0.03, runs)


def _order(rng: np.random.Generator, runs: int, draw: Draw) -> None:
    draw["number"] = rng.permutation(runs).astype(np.float64)
    _dwell(rng, runs, draw)


BY_HAND = 2.0
"""The effort of a run for which a person has to do something now and then."""

DESIGNS = (
    Design("dwell at random", "[dwell]\nmin_s = 1.0\nmax_s = 100.0\n", "", _dwell),
    Design("free azimuths", '[direction]\nmode = "free"\n', "", _free),
    Design(
        "tilt rates from 1 to 20 °/s",
        "[tilt]\nrate_deg_s = 1.0\n",
        "repeat the plan with rate_deg_s = 5.0 and 20.0",
        _rates,
        effort=BY_HAND,
    ),
    Design(
        "masses over ten to one",
        "",
        "change the block's mass (×0.5, 1, 2, 5) every few runs, in random order",
        _masses,
        effort=BY_HAND,
    ),
    Design(
        "plate turned in its mount",
        "",
        "turn the plate by 45°, 90° and 180° in its mount every quarter",
        _mount,
        effort=BY_HAND,
    ),
    Design("block turned", "", "turn the block by a random angle every few runs", _yaw, effort=BY_HAND),
    Design(
        "plate and block turned",
        "",
        "turn the plate by 45°, 90° and 180° in its mount every quarter, the block by a random angle every few runs",
        _both,
        effort=1.5 * BY_HAND,
    ),
    Design("designed starts", "", "put the block back to a random place every few runs", _starts, effort=BY_HAND),
    Design("dwell at random, in one long session", "[dwell]\nmin_s = 1.0\nmax_s = 100.0\n", "", _order),
)


def next_experiment(
    evidence: Evidence, found: Search, effects: Sequence[EffectFound], catalogue: Mapping[str, Effect]
) -> NextExperiment | None:
    """The plan that would settle the main finding, or else the strongest suspicion; None if there is neither.

    A finding is separated from the rest of its class; one that stands alone, from the effects that are known to look
    like it.
    """
    level = as_simulated(evidence, found.model).mu_s
    bench = Bench(mu_s=level, noise=found.model.noise, protocol=as_recorded(evidence))
    named = [effect for effect in effects if set(effect.class_ids) & catalogue.keys()]
    if named:
        main = max(named, key=lambda effect: _gained(found, effect))
        members = [catalogue[name] for name in main.class_ids if name in catalogue]
        rivals = members if len(members) > 1 else [members[0], *_alike(members[0], catalogue)]
        return separate(rivals, sizes=_sizes(found), bench=bench)
    suspicion = _suspicion(found)
    return None if suspicion is None else _confirm(suspicion, bench, catalogue)


def more_runs() -> NextExperiment:
    """The plan for a recording of which most runs could not be used."""
    design = next(design for design in DESIGNS if design.vary is _free)
    return NextExperiment(
        separates=(), plan=_toml(design, USUAL_RUNS), runs=USUAL_RUNS,
        why="too few runs can be used: free azimuths bring the block away from the border, where it leans on the foam",
    )  # fmt: skip


def _gained(found: Search, effect: EffectFound) -> float:
    """The largest gain of a candidate with the effect's id in the comparisons."""
    gains = [
        one.twice_gain
        for comparison in found.compared.values()
        for one in comparison.candidates
        if effect.id in one.ids
    ]
    return max(gains, default=0.0)


def _alike(effect: Effect, catalogue: Mapping[str, Effect]) -> list[Effect]:
    """The effects that are known to look like this one."""
    return [catalogue[name] for name in effect.confounded_with if name in catalogue]


def separate(
    effects: Sequence[Effect], *, sizes: Mapping[str, float] | None = None, bench: Bench | None = None
) -> NextExperiment:
    """The cheapest design that separates the first effect from the others.

    `sizes` are the effects' expected sizes by id, in typical sizes (1 by default); `bench` is the rig.
    """
    ids = tuple(effect.id for effect in effects)
    tried = [(_runs_needed(effects, design, sizes or {}, bench or Bench()), design) for design in DESIGNS]
    needed, design = min(tried, key=lambda pair: max(pair[0], FEWEST) * pair[1].effort)
    runs = _rounded(needed)
    if not runs < MOST:
        reason = "; ".join(dict.fromkeys(effect.separated_by for effect in effects))
        return NextExperiment(
            separates=(ids,),
            plan=_toml(DESIGNS[1], USUAL_RUNS),
            runs=USUAL_RUNS,
            why=f"no plan alone separates them: {reason}",
        )
    does = f" separates {' from '.join(ids)}" if len(ids) > 1 else f", to see {effects[0].id}"
    why = f"{design.name}{does}" + (f"; {design.by_hand}" if design.by_hand else "")
    return NextExperiment(separates=(ids,), plan=_toml(design, runs), runs=runs, why=why)


def _rounded(needed: float) -> int:
    """The number of runs to ask for, from FEWEST to MOST, rounded up to tens."""
    return math.ceil(min(max(needed, FEWEST), MOST) / 10) * 10


def _suspicion(found: Search) -> Effect | None:
    """The best single effect of the last stage, if it gained a little and nothing was chosen; else None."""
    last = found.stages[-1]
    if last.chosen is not None:
        return None
    singles = [one for one in last.candidates if len(one.effects) == 1 and not one.smooth and one.twice_gain > 4.0]
    return max(singles, key=lambda one: one.bic).effects[0] if singles and last.global_p < 0.5 else None


def _confirm(effect: Effect, bench: Bench, catalogue: Mapping[str, Effect]) -> NextExperiment:
    plan = separate([effect, *_alike(effect, catalogue)], bench=bench)
    return NextExperiment(
        separates=((effect.id, "none"),),
        plan=plan.plan,
        runs=plan.runs,
        why=f"to confirm or refute {effect.id}: {plan.why}",
    )


def _sizes(found: Search) -> dict[str, float]:
    sizes: dict[str, float] = {}
    for stage in found.stages:
        for one in stage.candidates:
            if one.fitted is None:
                continue
            for term in one.fitted.model.terms:
                largest = max(
                    (
                        abs(term.values[p.name] - p.null) / p.typical
                        for p in term.effect.parameters
                        if p.null is not None
                    ),
                    default=1.0,
                )
                sizes.setdefault(term.effect.id, max(largest, 0.1))
    return sizes


def _toml(design: Design, runs: int) -> str:
    by_hand = f"# by hand: {design.by_hand}\n" if design.by_hand else ""
    return f"# {design.name}\n{by_hand}samples = {runs}\n\n{design.plan}"


def _runs_needed(effects: Sequence[Effect], design: Design, sizes: Mapping[str, float], bench: Bench) -> float:
    """The number of runs that show the first effect while the others and mu are free; inf if none would.

    No recording has determined its shape yet: of the shapes that would show, the one with the least information beside
    the others counts.
    """
    session, null = trial(design.vary, bench)
    scored = scores(session, null, effects)
    first = effects[0]
    others = [column for variant in scored.variants if variant.effect is not first for column in variant.columns]
    own = [variant.columns for variant in scored.variants if variant.effect is first]
    alone = [_left(scored.information, columns, []) for columns in own]
    left = min(
        _left(scored.information, columns, others) - LAWS * shown
        for columns, shown in zip(own, alone, strict=True)
        if shown >= SHOWS * max(alone)
    )
    sharp = sizes.get(first.id, 1.0) ** 2 * left / TRIAL_RUNS
    return POWER**2 / sharp if sharp > 1e-12 else math.inf


def _left(information: Array, own: Sequence[int], others: Sequence[int]) -> float:
    """The largest information on one of the `own` numbers while the `others` are free."""
    if not own:
        return 0.0
    part = information[np.ix_(own, own)]
    if others:
        cross = information[np.ix_(own, others)]
        part = part - cross @ np.linalg.pinv(information[np.ix_(others, others)], rcond=1e-6, hermitian=True) @ cross.T
    return float(np.max(np.diag(part), initial=0.0))
