"""Diagnoses that several tests ask for: each is computed once, and whoever asks the same gets the same.

What is compared is what the ways make of an answer; the answer itself takes seconds and has tests of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import pytest

from station.app import diagnosing, simulated_again
from station.app.commands import plan
from station.diagnosis.diagnose import Examined, Source, examined, read
from station.diagnosis.given import Given, against_given
from station.diagnosis.next_experiment.plan import separate
from station.diagnosis.next_experiment.recommended import recommended
from station.diagnosis.predict import folds
from station.diagnosis.result import NextExperiment
from station.physics.catalogue import Catalogue
from station.physics.effect import Effect
from station.signals.session import Signals
from tests.answers import once

_ASKED = dict[int, tuple[Examined, tuple[Any, ...]]]()
"""Diagnoses by their identity, each with what was asked: it is a part of the next question about it."""


def ask_once(patched: pytest.MonkeyPatch) -> None:
    """The commands and the front door get the answers of this module."""
    patched.setattr(diagnosing, "examined", examined_once)
    patched.setattr(diagnosing, "recommended", recommended_once)
    patched.setattr(simulated_again, "against_given", _against_given)
    patched.setattr(plan, "separate", _separate)


def examined_once(recorded: Source, known: Catalogue, *, name: str, jobs: int = 1, **asked: Any) -> Examined:
    """Returns the diagnosis under this name, which is told with it and changes nothing else.

    The number of processes belongs to the question only where folds are searched: `folds.named` searches none.
    """
    source = read(recorded)
    said = {key: value for key, value in asked.items() if key != "progress"}
    among = 1 if asked["folding"] is folds.named else jobs
    question = ("examined", source, sorted(known), said, among)
    found = once(question, lambda: examined(source, known, jobs=jobs, **asked))
    return _asked(replace(found, diagnosis=replace(found.diagnosis, recording=name)), question)


def recommended_once(found: Examined, known: Catalogue) -> Examined:
    """Returns a diagnosis of `examined_once` with its next experiment."""
    question = ("recommended", _question(found), sorted(known))
    further = once(question, lambda: recommended(found, known))
    return _asked(replace(further, diagnosis=replace(further.diagnosis, recording=found.diagnosis.recording)), question)


def _asked(found: Examined, question: tuple[Any, ...]) -> Examined:
    _ASKED[id(found)] = found, question
    return found


def _question(found: Examined) -> tuple[Any, ...]:
    return _ASKED[id(found)][1]


def _against_given(found: Examined, simulated: Signals, known: Catalogue, **asked: Any) -> Given:
    """A simulation that is called for less friction is the one that made `simulated`, under its name."""
    said = {name: value for name, value in asked.items() if name not in ("again", "progress")}
    name = found.diagnosis.recording
    question = ("against", _question(found), name, simulated, sorted(known), said, asked["again"] is None)
    return once(question, lambda: against_given(found, simulated, known, **asked))


def _separate(effects: Sequence[Effect], known: Catalogue, *, mu_s: float) -> NextExperiment:
    asked = ("separate", [effect.id for effect in effects], sorted(known), mu_s)
    return once(asked, lambda: separate(effects, known, mu_s=mu_s))
