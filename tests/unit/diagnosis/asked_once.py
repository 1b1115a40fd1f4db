"""Answers that several tests of a module ask for: each is computed once, and whoever asks the same gets the same.

What is compared is what the ways make of an answer; the answer itself takes seconds and has tests of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import joblib
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

ANSWERS = dict[tuple[str, ...], Any]()
"""Answers by what was asked and the digest of all that it was asked with.

They are kept, so that the identity of one may be a part of the next question.
"""


def ask_once(patched: pytest.MonkeyPatch) -> None:
    """The commands and the front door get the answers of this module."""
    patched.setattr(diagnosing, "examined", _examined)
    patched.setattr(diagnosing, "recommended", _recommended)
    patched.setattr(simulated_again, "against_given", _against_given)
    patched.setattr(plan, "separate", _separate)


def _once(name: str, asked: tuple[Any, ...], answer: Callable[[], Any]) -> Any:
    digest = joblib.hash(asked)
    assert digest is not None
    if (name, digest) not in ANSWERS:
        ANSWERS[name, digest] = answer()
    return ANSWERS[name, digest]


def _examined(recorded: Source, known: Catalogue, *, jobs: int, **asked: Any) -> Examined:
    """The number of processes belongs to the question only where folds are searched: `folds.named` searches none."""
    source = read(recorded)
    said = {name: value for name, value in asked.items() if name != "progress"}
    among = 1 if asked["folding"] is folds.named else jobs
    return _once("examined", (source, sorted(known), said, among), lambda: examined(source, known, jobs=jobs, **asked))


def _recommended(found: Examined, known: Catalogue) -> Examined:
    return _once("recommended", (id(found), sorted(known)), lambda: recommended(found, known))


def _against_given(found: Examined, simulated: Signals, known: Catalogue, **asked: Any) -> Given:
    """A simulation that is called for less friction is the one that made `simulated`, under its name."""
    said = {name: value for name, value in asked.items() if name not in ("again", "progress")}
    key = (id(found), simulated, sorted(known), said, asked["again"] is None)
    return _once("against", key, lambda: against_given(found, simulated, known, **asked))


def _separate(effects: Sequence[Effect], known: Catalogue, *, mu_s: float) -> NextExperiment:
    asked = ([effect.id for effect in effects], sorted(known), mu_s)
    return _once("separate", asked, lambda: separate(effects, known, mu_s=mu_s))
