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
    level = any(one.name == "mu_s" for one in diagnosis.differs)
    if parts:
        said = "; ".join(["the friction has another level", *parts] if level else parts)
        return said[0].upper() + said[1:]
    if diagnosis.given:
        return "Nothing is left out of the simulation" + (", but its friction has another level" if level else "")
    if diagnosis.located:
        return "No missing effect is supported, although something depends on what one friction coefficient does not"
    return "No missing effect is supported: the plain model, one friction coefficient, explains this recording"


_CLAIMS: dict[Side, str] = {
    "both": "recording and simulation differ in {}",
    "recording": "the simulation leaves out {}",
    "simulation": "only the simulation has {}",
}


def in_order(diagnosis: Diagnosis) -> tuple[EffectFound, ...]:
    """The effects by probability; against a given simulation first those of both, then each one's own."""
    if not diagnosis.given:
        return diagnosis.effects
    return tuple(sorted(diagnosis.effects, key=lambda effect: list(_CLAIMS).index(effect.side)))


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
