"""The answer in words, for the terminal and for the page."""

from __future__ import annotations

from station.diagnosis.result import Diagnosis, EffectFound, Side


def sentence(diagnosis: Diagnosis) -> str:
    """The answer in one sentence."""
    return f"{_said(diagnosis)}."


def _said(diagnosis: Diagnosis) -> str:
    if diagnosis.verdict == "untestable":
        reason = diagnosis.notes[0] if diagnosis.notes else "the recording shows neither onset nor slide"
        return f"Nothing can be tested with this recording: {reason}"
    claimed = {side: claimed_effects(diagnosis, side) for side in ("recording", "both", "simulation")}
    parts = [words.format(_names(claimed[side])) for side, words in _CLAIMS.items() if claimed[side]]
    if parts:
        said = "; ".join(parts)
        return said[0].upper() + said[1:]
    if diagnosis.given:
        level = any(one.name == "mu_s" for one in diagnosis.differs)
        return "Nothing is left out of the simulation" + (", but its friction has another level" if level else "")
    if diagnosis.located:
        return "No missing effect is supported, although something depends on what one friction coefficient does not"
    return "No missing effect is supported: the plain model, one friction coefficient, explains this recording"


_CLAIMS: dict[Side, str] = {
    "recording": "The simulation leaves out {}",
    "both": "recording and simulation differ in {}",
    "simulation": "only the simulation has {}",
}


def claimed_effects(diagnosis: Diagnosis, *sides: Side) -> tuple[EffectFound, ...]:
    """The effects that are claimed, the likeliest first; with `sides`, only those that one of these sides has."""
    claimed = (effect for effect in diagnosis.effects if effect.verdict in ("supported", "indistinguishable"))
    return tuple(effect for effect in claimed if not sides or effect.side in sides)


def set_differently(diagnosis: Diagnosis) -> list[str]:
    """A sentence for each number that recording and simulation set differently, the level of friction first."""
    return [
        f"{one.name} is {one.recording} in the recording and {one.simulation} in the simulation"
        for one in diagnosis.differs
    ]


def _names(effects: tuple[EffectFound, ...]) -> str:
    return " and ".join(
        effect.title if len(effect.class_ids) < 2 else f"one of {', '.join(effect.class_ids)}" for effect in effects
    )


def next_lines(diagnosis: Diagnosis) -> list[str]:
    """The next experiment in a sentence, and the commands that do it."""
    plan = diagnosis.next_experiment
    if plan is None:
        return ["No further experiment is called for"]
    if not plan.plan:
        return [f"Next: {plan.why}"]
    do = f"station diagnose {diagnosis.recording} --plan next.toml; station run --plan next.toml"
    return [f"Next: {plan.runs} runs; {plan.why}", f"  {do}"]
