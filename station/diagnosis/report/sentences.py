"""The answer in words, for the terminal and for the page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from station.diagnosis import thresholds
from station.diagnosis.observations.left_out import HELD, LEANED
from station.diagnosis.result import Acting, Diagnosis, EffectFound, Side, rounded

LEAST_ACTING = 0.1
"""An effect that acts by less of the spread between equal runs widens that by half a per cent: it is not printed."""

GUESSED_DEG = 22.5
"""A guess of 45° misses by so much in the median, °, if all tilts from 0 to 90° are as likely. A model that
misses unseen onsets by more explains nothing."""

PATH_ERROR = "median path error at each run's own level of friction"
"""Unseen runs' paths begin from what their onsets show of the friction; a simulator's own paths have its friction."""


def sentence(diagnosis: Diagnosis) -> str:
    """Returns the answer in one sentence."""
    return f"{_said(diagnosis)}."


def _said(diagnosis: Diagnosis) -> str:
    if diagnosis.verdict == "untestable":
        return f"Nothing can be tested with this recording: {untestable_because(diagnosis)}"
    claimed = {side: claimed_effects(diagnosis, side) for side in ("recording", "both", "simulation")}
    baseline = "the simulation" if diagnosis.given else "a simulation with one constant friction"
    parts = [words.format(_names(claimed[side]), baseline=baseline) for side, words in _CLAIMS.items() if claimed[side]]
    unseen = tuple(effect for effect in diagnosis.effects if effect.verdict == "untestable")
    if unseen:
        parts.append(f"whether the simulation has {_names(unseen)} cannot be said, since it could not show there")
    if parts:
        said = "; ".join(["the friction has another level", *parts] if diagnosis.level_differs else parts)
        return said[0].upper() + said[1:]
    if diagnosis.given:
        return "Nothing is left out of the simulation" + _but(diagnosis)
    if diagnosis.located or diagnosis.global_p < thresholds.ALARM:
        return "No missing effect is supported, although something depends on what one friction coefficient does not"
    missed = diagnosis.fit.before.onset_median_deg
    if missed > GUESSED_DEG:
        return (
            f"No missing effect is supported, but one friction coefficient explains nothing here: it misses unseen "
            f"onsets by {missed:.1f}° in the median, and a guess of 45° by {GUESSED_DEG:g}°; "
            "check the unit of the angles"
        )
    return "No missing effect is supported: the plain model, one friction coefficient, explains this recording"


def untestable_because(diagnosis: Diagnosis) -> str:
    """Returns the reason why nothing could be tested."""
    return diagnosis.notes[0] if diagnosis.notes else "the recording shows neither onset nor slide"


def _but(diagnosis: Diagnosis) -> str:
    """Returns the rest of a sentence about a simulation that leaves nothing out, if it differs all the same."""
    if diagnosis.numerics:
        names = ", ".join(dict.fromkeys(str(one["id"]) for one in diagnosis.numerics))
        return f", but its solver has artefacts ({names})"
    if diagnosis.level_differs:
        return ", but its friction has another level"
    if diagnosis.differs:
        return ", but some of its numbers are others"
    return ", although no name explains all that differs" if diagnosis.global_p < thresholds.ALARM else ""


def used(diagnosis: Diagnosis) -> str:
    """Tells how many runs, rows or windows could be used."""
    of = "windows of {} rows" if diagnosis.counted == "windows" else f"of {{}} {diagnosis.counted}"
    return f"{diagnosis.used_runs} {of.format(diagnosis.total_runs)}"


_COUNTS = {LEANED: "only their slides count", HELD: "only that they held counts"}


def left_out(diagnosis: Diagnosis) -> str:
    """Tells how many runs were left out or have no onset, and why; empty if all count wholly."""
    out = _because(diagnosis.left_out, "{count} of {total} runs left out", diagnosis.total_runs)
    told = {
        f"{why} ({_COUNTS[why]})" if why in _COUNTS else why: count for why, count in diagnosis.without_onset.items()
    }
    unknown = _because(told, "{count} of the {total} used runs have no onset", diagnosis.used_runs)
    return "; ".join(one for one in (out, unknown) if one)


def _because(runs: Mapping[str, int], words: str, total: int) -> str:
    """Returns the words with the number of runs, and its reasons; empty without any run."""
    reasons = ", ".join(f"{count} {why}" for why, count in runs.items())
    return f"{words.format(count=sum(runs.values()), total=total)}: {reasons}" if reasons else ""


def singular(diagnosis: Diagnosis) -> str:
    """Returns the singular of what was counted."""
    return diagnosis.counted.removesuffix("s")


def as_expected(ratio: str) -> str:
    """Compares the gain with the one that the model expects of itself; the `ratio` may exceed 1."""
    return f"{ratio} times the gain to expect if the model is right (about 1: nothing is left to gain)"


def own_level(rerun: Mapping[str, Any]) -> str:
    """Says which runs a simulator did at their own level of friction; empty if no run has an onset that tells it."""
    before = rerun.get("before") or {}
    known, runs = before.get("onsets", 0), rerun.get("runs", 0)
    if not known or "own_level" not in before:
        return ""
    which = "each run at its" if known >= runs else f"{known} of {runs} runs at their"
    return f"{which} own level of friction"


_CLAIMS: dict[Side, str] = {
    "both": "recording and simulation differ in {}",
    "recording": "the recording shows {}, which {baseline} leaves out",
    "simulation": "only the simulation has {}",
}


def in_order(diagnosis: Diagnosis) -> tuple[EffectFound, ...]:
    """Returns the effects by probability; against a given simulation first those of both, then each one's own."""
    if not diagnosis.given:
        return diagnosis.effects
    return tuple(sorted(diagnosis.effects, key=lambda effect: list(_CLAIMS).index(effect.side)))


def claimed_effects(diagnosis: Diagnosis, *sides: Side) -> tuple[EffectFound, ...]:
    """Gives the effects that are claimed, the likeliest first; with `sides`, only those that one of these sides has."""
    claimed = (effect for effect in diagnosis.effects if effect.verdict in ("supported", "indistinguishable"))
    return tuple(effect for effect in claimed if not sides or effect.side in sides)


def acts(diagnosis: Diagnosis) -> list[str]:
    """Returns sentences on the phases in which the claimed effects act, without those that show less than a tenth."""
    found = [(effect, [_acts(diagnosis, one) for one in phases_of(effect)]) for effect in claimed_effects(diagnosis)]
    return [f"{who_acts(diagnosis, effect)} acts in: {'; '.join(phases)}" for effect, phases in found if phases]


def phases_of(effect: EffectFound) -> list[Acting]:
    """Returns the phases in which an effect acts by at least LEAST_ACTING in some run."""
    return [one for one in effect.acting if one.most[1] >= LEAST_ACTING]


def who_acts(diagnosis: Diagnosis, effect: EffectFound) -> str:
    """Returns the names of a class, and whose it is if a given simulation alone has it."""
    names = ", ".join(effect.class_ids)
    return f"{names} of the simulation" if diagnosis.given and effect.side == "simulation" else names


def _acts(diagnosis: Diagnosis, one: Acting) -> str:
    number, most = one.most
    counted, single = diagnosis.counted, singular(diagnosis)
    if one.median < LEAST_ACTING:
        share = f"in fewer than half of the {counted}"
        return f"{one.phase} ({share}; {rounded(most, 2)} times the spread between equal ones in {single} {number})"
    spread = f"{rounded(one.median, 2)} times the spread between equal {counted}"
    return f"{one.phase} ({spread}, {rounded(most, 2)} in {single} {number})"


def set_differently(diagnosis: Diagnosis) -> list[str]:
    """Returns a sentence for each number that recording and simulation set differently, the level of friction first."""
    return [
        f"{_level(diagnosis, one.name)} is {one.recording} in the recording and {one.simulation} in the simulation"
        for one in diagnosis.differs
    ]


def _level(diagnosis: Diagnosis, name: str) -> str:
    """Returns a number's name; the level's is that of the friction that was seen."""
    return diagnosis.level if name == "mu_s" else name


def _names(effects: tuple[EffectFound, ...]) -> str:
    return " and ".join(effect.title if len(effect.class_ids) < 2 else _either(effect) for effect in effects)


def _either(effect: EffectFound) -> str:
    *first, last = effect.members
    return f"either {', '.join(first)} or {last}"


def next_lines(diagnosis: Diagnosis) -> list[str]:
    """Returns the next experiment in a sentence, and the commands that do it."""
    plan = diagnosis.next_experiment
    if plan is None:
        return ["No further experiment is called for."]
    if not plan.plan:
        return [f"Next: {plan.why}."]
    do = f"station diagnose {diagnosis.recording} --plan next.toml; {plan.command('next.toml')}"
    return [f"Next: {plan.runs} runs; {plan.why}.", f"  {do}"]
