"""The next experiment: the plan that would tell apart what this recording cannot, and how many runs it needs.

Every design is tried on paper: its onsets and slides are laid out, the candidates' slopes there computed, and what is
left of one when the other and mu are free says how many runs show an effect of its size with 80 % power at 5 %.
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
"""Standard errors that show an effect in 80 of 100 experiments at a level of 5 %."""

FEWEST, MOST = 20, 5000
USUAL_RUNS = 200
LAWS = 0.05
"""The share of an effect's own information below which what is left of it rests on laws being exact."""

SHOWS = 0.5
"""The share of the best shape's information from which another shape would show as well."""


@dataclass(frozen=True)
class Design:
    """A way to run a session: its plan beside the defaults, what a person must do, and how it lays out the runs."""

    name: str
    plan: str
    by_hand: str
    vary: Vary
    effort: float = 1.0
    """By how much what a person has to do makes each run dearer."""


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
    """What would settle the main finding, or else the strongest suspicion; None if there is neither.

    A finding is tried against what it could not be told from here; one that stands alone, against what is known to
    look like it.
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
    """For a recording of which most runs could not be used."""
    design = next(design for design in DESIGNS if design.vary is _free)
    return NextExperiment(
        separates=(), plan=_toml(design, USUAL_RUNS), runs=USUAL_RUNS,
        why="too few runs can be used: free azimuths bring the block away from the border, where it leans on the foam",
    )  # fmt: skip


def _gained(found: Search, effect: EffectFound) -> float:
    """What the best of the effect's class gained where it was compared."""
    gains = [
        one.twice_gain
        for comparison in found.compared.values()
        for one in comparison.candidates
        if effect.id in one.ids
    ]
    return max(gains, default=0.0)


def _alike(effect: Effect, catalogue: Mapping[str, Effect]) -> list[Effect]:
    """The effects that are known to look like it."""
    return [catalogue[name] for name in effect.confounded_with if name in catalogue]


def separate(
    effects: Sequence[Effect], *, sizes: Mapping[str, float] | None = None, bench: Bench | None = None
) -> NextExperiment:
    """The cheapest design that separates the first effect from the others.

    `sizes` by id are the effects' expected sizes in their typical ones (1 by default); `bench` the rig.
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
    """Runs to ask for, from `FEWEST` to `MOST`, in tens."""
    return math.ceil(min(max(needed, FEWEST), MOST) / 10) * 10


def _suspicion(found: Search) -> Effect | None:
    """The best single of the last stage that gained a little and was not claimed."""
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
    """Runs for the first of the effects, the others and mu being free; infinitely many if never.

    What no recording has told yet is the first one's shape: of the shapes that would show, the one that shows least of
    itself beside the others counts.
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
    """The largest information on one of its own numbers when the others are free."""
    if not own:
        return 0.0
    part = information[np.ix_(own, own)]
    if others:
        cross = information[np.ix_(own, others)]
        part = part - cross @ np.linalg.pinv(information[np.ix_(others, others)], rcond=1e-6, hermitian=True) @ cross.T
    return float(np.max(np.diag(part), initial=0.0))
