"""The full fits of a stage: of the best candidates of each kind, and of the best singles beside what each leaves."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

from station.diagnosis import thresholds
from station.diagnosis.inference.fit import Fit
from station.diagnosis.search.by_paths import with_path_evidence
from station.diagnosis.search.candidates import Candidate, Fitter, single_candidates
from station.diagnosis.search.excused import excused
from station.physics.effect import Effect
from station.physics.smooth import is_smooth

FULL_FITS = {"single": 7, "pair": 5, "smooth": 5}
"""The number of candidates of each kind that a stage fits in full, by their scores."""

LEADING, PARTNERS = 3, 3
"""The number of leading single effects, and of partners that each is fitted with in full."""


def in_full(fitter: Fitter, current: Fit, ranked: Sequence[Candidate], offered: Sequence[Effect]) -> list[Candidate]:
    """Returns the best of each kind, fitted in full and ranked again without those that are not credible.

    The others follow.
    """
    kinds: dict[str, list[Candidate]] = {kind: [] for kind in FULL_FITS}
    for candidate in ranked:
        kinds[_kind(candidate)].append(candidate)
    full = dict[tuple[str, ...], Candidate]()
    for kind, many in kinds.items():
        for one in many[: FULL_FITS[kind]]:
            if one.twice_gain > thresholds.PROMISING and not told_by_one(one, full):
                full[one.key] = fitter.fitted(current, one)
    for pair in _partnered(fitter, kinds["pair"], full.values(), offered):
        if pair.key not in full:
            full[pair.key] = fitter.fitted(current, pair)
    good = with_path_evidence(fitter, [candidate for candidate in full.values() if candidate.credible])
    good = excused(fitter, current, good)
    rest = [candidate for candidate in ranked if candidate.key not in full]
    return [*sorted(good, key=lambda candidate: -candidate.twice_log_odds), *rest]


def told_by_one(pair: Candidate, full: Mapping[tuple[str, ...], Candidate]) -> bool:
    """Returns true if one effect of a pair alone, as a credible fit, has gained more than the scores promise of both.

    Whether the other one adds to it is told by the scores around that fit, see `_partnered`, or in the next stage.
    """
    alone = (full.get((effect.id,)) for effect in pair.effects)
    return len(pair.effects) > 1 and any(
        one is not None and one.credible and one.twice_gain > pair.twice_gain for one in alone
    )


def _partnered(
    fitter: Fitter, pairs: Sequence[Candidate], full: Iterable[Candidate], offered: Sequence[Effect]
) -> Iterator[Candidate]:
    """Yields the pairs of the best single effects with the best partners for what each leaves.

    Where an effect is strong, the scatter before it is fitted is too large to rank anything beside it by its score.
    """
    known = {pair.key: pair for pair in pairs}
    alone = [one for one in full if _kind(one) == "single" and one.credible and one.twice_log_odds > 0]
    for one in sorted(alone, key=lambda single: -single.twice_log_odds)[:LEADING]:
        for partner in _partners(fitter, one, offered)[:PARTNERS]:
            pair = known.get(tuple(sorted((*one.key, *partner.key))))
            if pair is not None and partner.twice_gain > thresholds.PROMISING:
                yield replace(pair, starts=(*one.starts, *partner.starts))


def _partners(fitter: Fitter, single: Candidate, offered: Sequence[Effect]) -> list[Candidate]:
    """Returns the named effects by their scores around a single effect's fit."""
    if single.fitted is None:
        return []
    rest = [effect for effect in offered if effect not in single.effects and not is_smooth(effect)]
    return sorted(single_candidates(fitter.evidence, single.fitted, rest), key=lambda partner: -partner.twice_log_odds)


def _kind(candidate: Candidate) -> str:
    return "smooth" if candidate.smooth else "single" if len(candidate.effects) == 1 else "pair"
