"""The search for effects that explain what the plain model does not, alone and in pairs, stage after stage.

Each stage tests the residuals of the best model so far. Scores rank all effects that the recording can show, alone and
in pairs, beside smooth terms without a name; the session's own null, drawn from that model, says how large the largest
gain is by chance. Only if it is larger are the best candidates fitted in full, and the likeliest joins the model. At
the end every term is compared once more with what could stand in its place beside all the others.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.inference.calibration import Calibration, calibrate
from station.diagnosis.inference.columns import Scores, at_sizes, scores, variants_of
from station.diagnosis.inference.fit import Fit, fit
from station.diagnosis.inference.level import levelled
from station.diagnosis.likelihood.systematic import allowing_for, claimable
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.search.candidates import Begins, Candidate, Fitter, candidates_of, place_candidate
from station.diagnosis.search.coinciding import Coinciding
from station.diagnosis.search.comparison import Comparison, revised
from station.diagnosis.search.excused import is_misfit_of_law
from station.diagnosis.search.full_fits import in_full
from station.diagnosis.search.places import places_of
from station.diagnosis.search.shared_terms import SharedTerms
from station.diagnosis.search.smooth import smooth_terms
from station.diagnosis.search.trifle import is_trifle, is_trifling_place
from station.diagnosis.search.untestable import untestable
from station.physics.effect import Effect
from station.physics.model import Model
from station.physics.smooth import is_smooth

NONE_COINCIDE = Coinciding()

Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Stage:
    """One test of the residuals of `before`: corrected p, candidates by rank, places, and the chosen candidate.

    `shared` has the smallest p of friction that depends on a covariate, by covariate and phase, see `shared_terms`.
    """

    before: Fit
    global_p: float
    calibration: Calibration
    candidates: tuple[Candidate, ...]
    places: tuple[Candidate, ...]
    chosen: Candidate | None
    tried: int
    shared: Mapping[tuple[str, str], float] = field(default_factory=dict[tuple[str, str], float])


@dataclass(frozen=True, eq=False, kw_only=True)
class Search:
    """All stages. `model` is the last fit, `places` stand out where no effect acts, `untestable` has reasons by id.

    `compared` has, for each term of the model by its id, what could stand in its place; it is empty until `search` has
    compared them. `offered` are the effects and smooth terms that this evidence can show, which `fitter` has fitted.
    """

    null: Fit
    stages: tuple[Stage, ...]
    model: Fit
    places: tuple[Candidate, ...]
    untestable: Mapping[str, str]
    offered: Sequence[Effect]
    fitter: Fitter
    compared: Mapping[str, Comparison] = field(default_factory=dict[str, Comparison])

    @property
    def global_p(self) -> float:
        """The corrected p-value of the plain model."""
        return self.stages[0].global_p

    @property
    def found(self) -> tuple[Effect, ...]:
        """The effects in the model, smooth terms among them."""
        return tuple(claimable(self.model.model))

    @property
    def named(self) -> tuple[str, ...]:
        """Ids of the catalogue's effects in the model."""
        return tuple(effect.id for effect in self.found if not is_smooth(effect))


def in_stages(
    evidence: Evidence,
    effects: Sequence[Effect],
    *,
    start: Model,
    rng: np.random.Generator,
    progress: Progress,
    begins: Begins | None = None,
    numerics: bool = False,
) -> Search:
    """Runs all stages, on evidence with at least one row of friction; the terms are not yet compared in their places.

    With `numerics` a simulator's artefacts are sought, too: in a simulation, and in no recording. If `begins` is given,
    fits begin where those of nearly the same runs ended: they end at the same maximum.
    """
    progress("fitting the plain model")
    effects = [effect for effect in effects if numerics or effect.layer != "numerics"]
    null = fit(evidence, levelled(evidence, start), ())
    reasons = untestable(evidence, null, effects)
    absorbed = [effect for effect in effects if effect.absorbed_by_mu and effect.id in reasons]
    null = fit(evidence, allowing_for(null.model, absorbed), (), noise=null.noise)
    offered = [*(effect for effect in effects if effect.id not in reasons), *smooth_terms(evidence)]
    fitter = Fitter(evidence, begins, coinciding=Coinciding.among(evidence, offered))
    model, stages = fitter.likelier(null, ()), list[Stage]()
    for number in range(int(thresholds.MOST_STAGES)):
        progress(f"stage {number + 1}: scoring {len(offered)} effects and smooth terms, alone and in pairs")
        stages.append(_stage(fitter, model, offered, rng=rng, first=number == 0, progress=progress))
        chosen = stages[-1].chosen
        if chosen is None or chosen.fitted is None:
            break
        model = chosen.fitted
    return Search(
        null=null,
        stages=tuple(stages),
        model=model,
        places=tuple(stage.chosen for stage in stages if stage.chosen is not None and stage.chosen.fitted is None),
        untestable=reasons,
        offered=tuple(offered),
        fitter=fitter,
    )


def search(found: Search, rng: np.random.Generator, progress: Progress) -> Search:
    """Compares each term that the stages have found with what could stand in its place."""
    progress("comparing each with what could stand in its place")
    model, compared = revised(found.fitter, found.model, found.offered, rng.spawn(1)[0])
    return replace(found, model=model, compared=compared)


def _stage(
    fitter: Fitter,
    current: Fit,
    offered: Sequence[Effect],
    *,
    rng: np.random.Generator,
    first: bool,
    progress: Progress,
) -> Stage:
    coinciding = fitter.coinciding
    stage, scored = looked_at(fitter.evidence, current, offered, rng=rng, progress=progress, coinciding=coinciding)
    if stage.global_p >= (thresholds.ALARM if first else thresholds.NEXT):
        return stage
    progress("fitting the best candidates in full")
    ranked = in_full(fitter, current, stage.candidates, _rest(current, offered, coinciding))
    standing = [spot for spot in stage.places if spot.place and not is_trifling_place(scored, spot.place)]
    chosen = _chosen(fitter, current, ranked, standing)
    return replace(stage, candidates=tuple(ranked), chosen=chosen)


def looked_at(
    evidence: Evidence,
    current: Fit,
    offered: Sequence[Effect],
    *,
    rng: np.random.Generator,
    progress: Progress,
    coinciding: Coinciding = NONE_COINCIDE,
) -> tuple[Stage, Scores]:
    """Returns the test of what a fit leaves: candidates and places with their corrected p; nothing is chosen yet."""
    rest = _rest(current, offered, coinciding)
    places, columns = places_of(evidence, _column_count(evidence, rest))
    scored = at_sizes(evidence, current, scores(evidence, current, rest, columns))
    candidates, couples = candidates_of(scored, coinciding)
    spots = [place_candidate(scored, place, of=len(places)) for place in places]
    progress(f"drawing the session's null for {len(candidates) + len(spots)} candidates")
    sets = [variant.columns for variant in scored.variants] + [place.columns for place in places]
    sets += [(*one.columns, *two.columns) for one, two in couples]
    shared = SharedTerms.of(scored, places)
    calibration = calibrate(scored, sets, rng, further=shared.gains())
    stage = Stage(
        before=current,
        global_p=calibration.corrected(min((one.p for one in [*candidates, *spots]), default=1.0)),
        calibration=calibration,
        candidates=tuple(sorted(candidates, key=lambda candidate: -candidate.twice_log_odds)),
        places=tuple(sorted(spots, key=lambda spot: spot.p)),
        chosen=None,
        tried=len(candidates) + len(spots),
        shared=shared.smallest(),
    )
    return stage, scored


def _rest(current: Fit, offered: Sequence[Effect], coinciding: Coinciding) -> list[Effect]:
    """Gives the effects offered, not in the model, and no other law of a covariate that runs together with its own."""
    acting = {term.effect.id for term in current.model.terms}
    return [effect for effect in offered if effect.id not in acting and not coinciding.repeats(effect, acting)]


def _column_count(evidence: Evidence, effects: Sequence[Effect]) -> int:
    """Returns the number of columns of the effects' variants, after which those of the places begin."""
    return sum(
        not parameter.is_shape for effect, _ in variants_of(evidence, effects) for parameter in effect.parameters
    )


def _chosen(fitter: Fitter, current: Fit, ranked: Sequence[Candidate], spots: Sequence[Candidate]) -> Candidate | None:
    """Returns the likeliest candidate, if it is likelier than nothing, and neither misspecification nor negligible.

    Otherwise it is None.

    A place stands for what no effect can express: it counts only in channels in which no smooth term acts.
    """
    full = [candidate for candidate in ranked if candidate.fitted is not None]
    alone = [spot for spot in spots if spot.place is not None and not spot.place.channel.frictional]
    for one in sorted([*full, *alone], key=lambda candidate: -candidate.twice_log_odds):
        trifle = one.fitted is not None and is_trifle(fitter.evidence, current, one.fitted)
        if one.twice_log_odds > 0 and not trifle and not is_misfit_of_law(fitter, current, one):
            return one
    return None
