"""Every rival does with the same cases what others would: one file each, found by being here.

A file has one subclass of `Rival`. It gets the tool's evidence as a table of onsets and slides and the folds, and
answers with names, a place and held-out scores, as far as its kind can.
"""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import pkgutil
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from station.diagnosis.inference.fit import Fit
from station.diagnosis.inference.noise_of import noise_of
from station.diagnosis.likelihood.slopes import residuals
from station.diagnosis.likelihood.student import log_density
from station.diagnosis.likelihood.whitening import Whitening, stack
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.onsets import Onsets
from station.diagnosis.observations.plate import Times
from station.diagnosis.predict.held_out import HeldOut
from station.physics.catalogue import Catalogue
from station.physics.contact import Array, Bools
from station.signals.session import Signals


@dataclass(frozen=True, eq=False, kw_only=True)
class Table:
    """A case as a table: the evidence, the plain fit of mu, the fold of each run (runs,), the catalogue.

    `signals` is the recording itself, for rivals that simulate it.
    """

    signals: Signals
    evidence: Evidence
    plain: Fit
    fold: Array
    catalogue: Catalogue


@dataclass(frozen=True, eq=False, kw_only=True)
class Answer:
    """Names (the surest first), a place (phase, covariate), predictions of unseen runs; None: does not say."""

    names: tuple[str, ...] = ()
    place: tuple[str, str] | None = None
    held: HeldOut | None = None


class Rival(ABC):
    """One way of others. `needs` is the package that it cannot run without."""

    name: ClassVar[str]
    title: ClassVar[str]
    says_names: ClassVar[bool]
    says_places: ClassVar[bool]
    needs: ClassVar[str] = ""

    def why_not(self) -> str | None:
        """Says why the rival cannot run here; None if it can."""
        if self.needs and importlib.util.find_spec(self.needs) is None:
            return f"the package {self.needs} is not installed"
        return None

    @abstractmethod
    def answer(self, table: Table) -> Answer:
        """Its answer on one case."""


def rivals() -> dict[str, Rival]:
    """All rivals by name."""
    found: dict[str, Rival] = {}
    for info in sorted(pkgutil.iter_modules(__path__), key=lambda one: one.name):
        module = importlib.import_module(f"{__name__}.{info.name}")
        for value in vars(module).values():
            if inspect.isclass(value) and issubclass(value, Rival) and value.__module__ == module.__name__:
                found[value.name] = value()
    return found


NOT_HERE: Mapping[str, str] = MappingProxyType({})
"""Rivals that were thought of and have no file, with the reason."""


def reasons() -> dict[str, str]:
    """The reason of every rival that cannot run here."""
    return {name: why for name, rival in rivals().items() if (why := rival.why_not())} | dict(NOT_HERE)


def rival_named(name: str) -> Rival:
    """The rival of that name."""
    return rivals()[name]


TOGETHER: tuple[str, ...] = ("onset", "along")
"""Channels that one draw of friction moves alike: a correction of one alone would part them."""

Predict = Callable[[str, Bools], Array]
"""The corrections of a channel's rows (n,), as learnt from some runs (runs,)."""


def held_out_corrected(table: Table, channels: Collection[str], predict: Predict) -> HeldOut:
    """Predictions by corrections of some channels: log densities and onsets; a correction simulates no slide.

    The noise must not be taken from residuals of rows that a correction has learnt by heart: in the runs that it is
    estimated on, each fold is corrected by what the others taught. Whoever cross-validates leaves a correction out that
    makes things worse: nobody is scored on one (which of them help is told by all runs, a little in a rival's favour).
    """
    fold, numbers = table.fold, np.unique(table.fold).tolist()
    known: dict[tuple[str, frozenset[int]], Array] = {}

    def without(name: str, *left_out: int) -> Array:
        key = name, frozenset(left_out)
        if key not in known:
            known[key] = predict(name, ~np.isin(fold, left_out))
        return known[key]

    def out_of_fold(name: str, *left_out: int) -> Array:
        """A channel's corrections: each fold's as the others taught, less those that are left out for all."""
        rows_fold = fold[_rows(table, name)]
        correction = np.zeros(len(rows_fold))
        for number in numbers:
            rows = rows_fold == number
            correction[rows] = without(name, number, *left_out)[rows]
        return correction

    kept = _helpful(table, {name: out_of_fold(name) for name in channels})
    nothing = np.full(table.evidence.runs, np.nan)
    log_run, onset = nothing.copy(), nothing.copy()
    for number in numbers:
        correction = {name: out_of_fold(name, number) for name in kept}
        log_run[fold == number] = corrected_log_run(table, correction, fold != number)[fold == number]
        onset[fold == number] = _onset_errors(table, correction.get("onset"))[fold == number]
    return HeldOut(log_run, onset, nothing, nothing, nothing, nothing)


def _onset_errors(table: Table, correction: Array | None) -> Array:
    """Errors (runs,) of the plain model's onsets less a correction (rows,) of their relative friction, rad."""
    errors, channel = np.full(table.evidence.runs, np.nan), table.evidence.onsets
    if isinstance(channel, Onsets):
        residual, tilt = channel.residual(table.plain.model), channel.angle_rad()
        left = residual - (0.0 if correction is None else correction)
        slid = ~channel.rows.limit
        errors[channel.rows.run[slid]] = (left * np.sin(tilt) * np.cos(tilt))[slid]
    return errors


def _rows(table: Table, name: str) -> Times:
    """The run of each of a channel's rows."""
    channel = table.evidence.channel(name)
    assert channel is not None
    return channel.rows.run


def _helpful(table: Table, correction: Mapping[str, Array]) -> list[str]:
    """The channels whose corrections make the runs likelier, the most helpful first, and so on while any does."""
    left = [part for part in (TOGETHER, *((name,) for name in correction)) if set(part) <= correction.keys()]
    everything = np.ones(table.evidence.runs, dtype=np.bool_)

    def score(names: Sequence[str]) -> float:
        return float(np.nanmean(corrected_log_run(table, {name: correction[name] for name in names}, everything)))

    kept: list[str] = []
    best = score(kept)
    while left:
        scores = [score([*kept, *part]) for part in left]
        if max(scores) <= best:
            break
        best = max(scores)
        kept += left[scores.index(best)]
        left = [part for part in left if not set(part) & set(kept)]
    return kept


def corrected_log_run(table: Table, correction: Mapping[str, Array], train: Bools) -> Array:
    """Log densities (runs,) of the residuals of the plain model less a correction (rows,) by channel.

    The noise is estimated on the runs of `train` (runs,) alone; the likelihood is the tool's.
    """
    evidence = table.evidence
    at = {
        name: values - correction.get(name, np.zeros(len(values)))
        for name, values in residuals(evidence, table.plain.model).items()
    }
    known = evidence.without(~train)
    whitening = Whitening(evidence, noise_of(known, at))
    density = log_density(whitening(stack(evidence, at)), whitening.tail, whitening.limit)
    log_run = np.bincount(whitening.run, density, evidence.runs) - whitening.log_scale
    present = np.zeros(evidence.runs, dtype=np.bool_)
    present[whitening.run] = True
    return np.where(present, log_run, np.nan)
