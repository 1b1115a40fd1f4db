"""The next experiment: the plan that would tell apart what this recording cannot, and how many runs it needs.

Every design is tried on paper: its onsets and slides are laid out, the candidates' slopes there computed, and what is
left of one when the other and mu are free says how many runs show an effect of its size with 80 % power at 5 %.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from station.gap.evidence.channel import Rows, rows_of
from station.gap.evidence.evidence import Evidence
from station.gap.evidence.moments import Moments, RunFacts
from station.gap.evidence.onsets import Onsets
from station.gap.evidence.plate import Attitude, Times
from station.gap.evidence.slides import Across, Along, Motion, Turn
from station.gap.result import EffectFound, NextExperiment
from station.gap.search import Search
from station.gap.statistics.columns import scores
from station.gap.statistics.fit import Fit, fit
from station.gap.statistics.noise import GAUSSIAN, Noise
from station.physics.contact import GRAVITY_M_S2, Array
from station.physics.effect import Effect
from station.physics.model import Model

TRIAL_RUNS = 120
POWER = 2.8
"""Standard errors that show an effect in 80 of 100 experiments at a level of 5 %."""

FEWEST, MOST = 20, 5000
USUAL_RUNS = 200
LAWS = 0.05
"""The share of an effect's own information below which what is left of it rests on laws being exact."""

SLIDE_POINTS = 4
Draw = dict[str, Array]


@dataclass(frozen=True)
class Design:
    """A way to run a session: its plan beside the defaults, what a person must do, and how it lays out the runs."""

    name: str
    plan: str
    by_hand: str
    vary: Callable[[np.random.Generator, int, Draw], None]


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


def _starts(rng: np.random.Generator, runs: int, draw: Draw) -> None:
    draw["x"], draw["y"] = rng.uniform(-0.03, 0.03, runs), rng.uniform(-0.03, 0.03, runs)


def _order(rng: np.random.Generator, runs: int, draw: Draw) -> None:
    draw["number"] = rng.permutation(runs).astype(np.float64)
    _dwell(rng, runs, draw)


DESIGNS = (
    Design("dwell at random", "[dwell]\nmin_s = 1.0\nmax_s = 100.0\n", "", _dwell),
    Design("free azimuths", '[direction]\nmode = "free"\n', "", _free),
    Design(
        "tilt rates from 1 to 20 °/s",
        "[tilt]\nrate_deg_s = 1.0\n",
        "repeat the plan with rate_deg_s = 5.0 and 20.0",
        _rates,
    ),
    Design(
        "masses over ten to one", "", "change the block's mass (×0.5, 1, 2, 5) every few runs, in random order", _masses
    ),
    Design("plate turned in its mount", "", "turn the plate by 45°, 90° and 180° in its mount every quarter", _mount),
    Design("block turned", "", "turn the block by a random angle every few runs", _yaw),
    Design("designed starts", "", "put the block back to a random place every few runs", _starts),
    Design("dwell at random, in one long session", "[dwell]\nmin_s = 1.0\nmax_s = 100.0\n", "", _order),
)


def next_experiment(
    found: Search, effects: Sequence[EffectFound], catalogue: Mapping[str, Effect]
) -> NextExperiment | None:
    """What would settle the main finding, or else the strongest suspicion; None if there is neither.

    A finding is tried against what it could not be told from here; one that stands alone, against what is known to
    look like it.
    """
    named = [effect for effect in effects if set(effect.class_ids) & catalogue.keys()]
    if named:
        main = max(named, key=lambda effect: _gained(found, effect))
        members = [catalogue[name] for name in main.class_ids if name in catalogue]
        rivals = members if len(members) > 1 else [members[0], *_alike(members[0], catalogue)]
        return separate(rivals, sizes=_sizes(found), noise=found.model.noise, mu_s=found.model.model.mu_s)
    suspicion = _suspicion(found)
    return None if suspicion is None else _confirm(suspicion, found, catalogue)


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
    effects: Sequence[Effect],
    *,
    sizes: Mapping[str, float] | None = None,
    noise: Noise | None = None,
    mu_s: float = 0.4,
) -> NextExperiment:
    """The cheapest design that separates the first effect from the others.

    `sizes` by id are the effects' expected sizes in their typical ones (1 by default); `noise` the rig's.
    """
    ids = tuple(effect.id for effect in effects)
    tried = [(_runs_needed(effects, design, sizes or {}, noise, mu_s), design) for design in DESIGNS]
    # What a person has to do costs as much as twice the runs.
    needed, design = min(tried, key=lambda pair: pair[0] * (2.0 if pair[1].by_hand else 1.0))
    runs = _rounded(needed)
    if not runs < MOST:
        reason = "; ".join(dict.fromkeys(effect.separated_by for effect in effects))
        return NextExperiment(
            separates=(ids,),
            plan=_toml(DESIGNS[1], USUAL_RUNS),
            runs=USUAL_RUNS,
            why=f"no plan alone separates them: {reason}",
        )
    does = f"separates {' from '.join(ids)}" if len(ids) > 1 else f"shows {effects[0].id}"
    why = f"{design.name} {does}" + (f"; {design.by_hand}" if design.by_hand else "")
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


def _confirm(effect: Effect, found: Search, catalogue: Mapping[str, Effect]) -> NextExperiment:
    noise, mu_s = found.model.noise, found.model.model.mu_s
    plan = separate([effect, *_alike(effect, catalogue)], noise=noise, mu_s=mu_s)
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


def _runs_needed(
    effects: Sequence[Effect], design: Design, sizes: Mapping[str, float], noise: Noise | None, mu_s: float
) -> float:
    """Runs for the first of the effects, the others and mu being free; infinitely many if never."""
    trial, null = _trial(design, noise, mu_s)
    scored = scores(trial, null, effects)
    first = effects[0]
    own = [column for variant in scored.variants if variant.effect is first for column in variant.columns]
    others = [column for variant in scored.variants if variant.effect is not first for column in variant.columns]
    information = _left(scored.information, own, others) - LAWS * _left(scored.information, own, [])
    sharp = sizes.get(first.id, 1.0) ** 2 * information / TRIAL_RUNS
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


def _trial(design: Design, noise: Noise | None, mu_s: float) -> tuple[Evidence, Fit]:
    """A session on paper: the standard protocol with what the design varies, without any effect."""
    rng = np.random.default_rng(7)
    runs = TRIAL_RUNS
    quarter = rng.integers(0, 4, runs)
    draw: Draw = {
        "down": quarter * math.pi / 2,
        "x": rng.normal(0, 0.012, runs),
        "y": rng.normal(0, 0.012, runs),
        "yaw": rng.normal(0, 0.03, runs),
        "mount": np.zeros(runs),
        "mass_kg": np.full(runs, 0.008),
        "rate": np.full(runs, math.radians(5.0)),
        "rest_s": np.full(runs, 8.0) * np.exp(rng.normal(0, 0.02, runs)),
        "number": np.arange(runs, dtype=np.float64),
    }
    design.vary(rng, runs, draw)
    facts = RunFacts(
        number=draw["number"],
        rest_ns=-np.round(draw["rest_s"] * 1e9).astype(np.int64),
        mount_rad=draw["mount"],
        mass_kg=draw["mass_kg"],
        area_m2=np.full(runs, 1e-4),
        temperature_c=np.full(runs, np.nan),
        relative_humidity=np.full(runs, np.nan),
    )
    channels = (_onsets(draw, facts, mu_s), *_slides(draw, facts, mu_s))
    trial = Evidence(channels=channels, run_number=draw["number"], facts=facts, total_runs=runs)
    return trial, fit(trial, Model(mu_s=mu_s), (), noise=_noise(noise), refine=False, steps=1)


def _noise(noise: Noise | None) -> Noise:
    names = ("onset", "along", "across", "turn")
    if noise is None:
        own = {"onset": 0.04, "along": 0.02, "across": 0.002, "turn": 0.3}
        return Noise(friction=0.1, own=own, factor=dict.fromkeys(names, 1.0), tail=dict.fromkeys(names, GAUSSIAN))
    return Noise(
        friction=noise.friction,
        own={name: noise.own.get(name, 0.02) for name in names},
        factor={name: noise.factor.get(name, 1.0) for name in names},
        tail=dict.fromkeys(names, GAUSSIAN),
    )


def _attitude(draw: Draw, tilt: Array, place: Times, delay_s: float) -> Attitude:
    rate, down = draw["rate"][place], draw["down"][place]
    tilt = tilt - rate * delay_s
    gravity = np.column_stack([np.sin(tilt) * np.cos(down), np.sin(tilt) * np.sin(down), -np.cos(tilt)])
    axis = np.column_stack([-np.sin(down), np.cos(down), np.zeros(len(down))])
    return Attitude(
        gravity, axis * rate[:, None], np.zeros((len(down), 3)), np.ones(len(down)), np.full(len(down), 0.1)
    )


def _moments(draw: Draw, facts: RunFacts, tilt: Array, place: Times, *, speed: Array, time_ns: Times) -> Moments:
    way = np.column_stack([np.cos(draw["down"][place]), np.sin(draw["down"][place])])
    return Moments(
        time_ns=time_ns,
        run=place,
        facts=facts,
        attitude=lambda delay_s: _attitude(draw, tilt, place, delay_s),
        place_m=np.column_stack([draw["x"][place], draw["y"][place]]) + way * (speed**2)[:, None],
        yaw_rad=draw["yaw"][place],
        velocity_m_s=speed[:, None] * way,
        moving=speed > 0,
        slip_ns=np.zeros(len(place), dtype=np.int64),
        border_m=np.full(len(place), np.inf),
    )


def _rows(run: Times, sigma: float) -> Rows:
    count = len(run)
    none = np.zeros(count, dtype=np.int64)
    return rows_of({"run": run, "from_ns": none, "to_ns": none, "sigma": np.full(count, sigma)}, {})


def _onsets(draw: Draw, facts: RunFacts, mu_s: float) -> Onsets:
    place = np.arange(TRIAL_RUNS)
    tilt = np.full(TRIAL_RUNS, math.atan(mu_s))
    moments = _moments(
        draw, facts, tilt, place, speed=np.zeros(TRIAL_RUNS), time_ns=np.zeros(TRIAL_RUNS, dtype=np.int64)
    )
    return Onsets(_rows(place, 0.003), moments)


def _slides(draw: Draw, facts: RunFacts, mu_s: float) -> tuple[Along, Across, Turn]:
    """A few windows of each slide, from slow to fast, at speeds that grow with the tilt rate."""
    runs = np.repeat(np.arange(TRIAL_RUNS), SLIDE_POINTS)
    share = np.tile((np.arange(SLIDE_POINTS) + 0.5) / SLIDE_POINTS, TRIAL_RUNS)
    place = np.repeat(runs, 3)
    speed = np.repeat(0.12 * share * np.sqrt(draw["rate"][runs] / math.radians(5.0)), 3)
    excess = np.repeat(0.03 * share, 3)
    tilt = math.atan(mu_s) + excess
    time_ns = np.round(np.repeat(0.5 * share, 3) * 1e9).astype(np.int64)
    moments = _moments(draw, facts, tilt, place, speed=speed, time_ns=time_ns)
    middle = slice(1, None, 3)
    gained = GRAVITY_M_S2 * (np.sin(tilt) - mu_s * np.cos(tilt))[middle]
    way = np.column_stack([np.cos(draw["down"][runs]), np.sin(draw["down"][runs])])
    motion = Motion(moments, gained[:, None] * way, np.zeros(len(runs)))
    return Along(_rows(runs, 0.006), motion), Across(_rows(runs, 0.006), motion), Turn(_rows(runs, 0.8), motion)
