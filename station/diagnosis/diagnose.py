"""The diagnosis of one recording from signals or samples: evidence, search, folds, posteriors, quality, answer.

`examined` tells the story from top to bottom: each line is a step, and each step is a folder of this package. The next
experiment is recommended apart, see `next_experiment.recommended`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from shared.messages import Sample
from station.diagnosis.answer import Assessment, answered, refusal, why_not
from station.diagnosis.inference.fit import Fit
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.rig_offsets import UNKNOWN_OFFSETS, RigOffsets
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.table import table_evidence
from station.diagnosis.predict.folds import Folding, assigned, less, named
from station.diagnosis.predict.quality import compared, sifted
from station.diagnosis.report.picture_data import PictureData, picture_data
from station.diagnosis.result import Counted, Diagnosis, HeldOutGain
from station.diagnosis.search.posterior import posteriors_of
from station.diagnosis.search.search import Progress, Search, in_stages, search
from station.diagnosis.simulation_comparison import Found
from station.physics.catalogue import Catalogue
from station.physics.model import Model
from station.signals.measured import Measured
from station.signals.session import Signals

Recorded = Signals | Measured | Sequence[Sample]
"""A session's signals, the rows of a table, or samples alone."""

Source = Recorded | Callable[[], Recorded]
"""A recording, or a function that reads one, which is then kept only until its evidence is taken."""


def read(source: Source) -> Recorded:
    """Returns the recording, read now if it was not read yet."""
    return source() if callable(source) else source


def evidence_from(recorded: Recorded, setting: Setting, rig_offsets: RigOffsets = UNKNOWN_OFFSETS) -> Evidence:
    """Returns the evidence of a session, whose slips are read with `rig_offsets`, or of a table."""
    if isinstance(recorded, Signals):
        return evidence_of(recorded, setting, rig_offsets)
    return table_evidence(recorded, setting)


@dataclass(frozen=True, kw_only=True)
class Examined:
    """A diagnosis, the data of its figures, and what was found in which evidence (None if nothing could be tested)."""

    diagnosis: Diagnosis
    pictures: PictureData
    found: Found | None = None


def examined(
    recorded: Source,
    catalogue: Catalogue,
    *,
    name: str = "",
    setting: Setting | None = None,
    mu_s: float = 0.4,
    seed: int = 1,
    folding: Folding = named,
    jobs: int = 1,
    progress: Progress = lambda _: None,
) -> Examined:
    """Returns the diagnosis, with the data of the report's figures.

    Args:
        recorded: a session, or the rows of a table; or what reads it.
        catalogue: the effects to consider; `station.physics.catalogue.catalogue()` has them all.
        name: the recording's name in the result.
        setting: sizes of plate and block.
        mu_s: where the plain model's fit begins.
        seed: seeds the null's draws and the folds; the same seed gives the same answer.
        folding: how runs are held out: `folds.named`, or `folds.nested`, which searches anew in each fold.
        jobs: processes that search the folds in parallel; with 1 no other process is started.
        progress: is called with a message before each step.
    """
    chosen = setting or Setting()
    evidence, counted = _evidence(recorded, chosen, progress)
    why = why_not(evidence)
    if why:
        refused = replace(refusal(evidence, catalogue, why, name=name), counted=counted)
        return Examined(diagnosis=refused, pictures=PictureData())
    rng = np.random.default_rng(seed)
    effects = tuple(catalogue.values())
    staged = partial(in_stages, effects=effects, start=Model(mu_s=mu_s), rng=rng, progress=progress)
    found = staged(evidence)
    rig_offsets = RigOffsets.of(found.model.model)
    # A table has no paths to read slips from.
    if evidence.slide_tracks is not None and not rig_offsets.is_near(evidence.rig_offsets):
        progress("reading the slips again by the clocks and the pivot that were found")
        evidence, _ = _evidence(recorded, chosen, progress, rig_offsets)
        found = staged(evidence, begins=found.fitter.ends())
    found = search(found, rng, progress)
    progress("predicting each fold of the runs by the others")
    folds = folding(evidence, effects, found, fold=assigned(evidence, rng), seed=seed, jobs=jobs)
    posteriors = posteriors_of(found)
    sift = sifted(evidence, folds, posteriors.classes)
    model = _kept(evidence, found, sift.gains)
    quality = compared(evidence, sift, model)
    answer = answered(
        evidence, found, Assessment(posteriors, sift.gains, model, quality), catalogue, name=name, rng=rng
    )
    pictures = picture_data(evidence, found, (sift.before, sift.after), opening_radius_m=chosen.opening_radius_m)
    result = Found(evidence=evidence, search=found, posteriors=posteriors, folds=sift.folds)
    return Examined(diagnosis=replace(answer, counted=counted), pictures=pictures, found=result)


def _evidence(
    source: Source, setting: Setting, progress: Progress, rig_offsets: RigOffsets = UNKNOWN_OFFSETS
) -> tuple[Evidence, Counted]:
    """Returns the evidence of what was recorded, which itself is no longer needed then, and what is counted in it."""
    recorded = read(source)
    progress("reading the evidence")
    evidence = evidence_from(recorded, setting, rig_offsets)
    return evidence, _counted(recorded, evidence)


def _counted(recorded: Recorded, evidence: Evidence) -> Counted:
    """Names what is counted: a session's runs, a table's rows, or the windows in which its rows were averaged."""
    if isinstance(recorded, Signals):
        return "runs"
    record = evidence.slides is not None and evidence.slides.travelled_m is not None
    return "windows" if record else "rows"


def _kept(evidence: Evidence, found: Search, gains: Mapping[str, HeldOutGain]) -> Fit:
    """Returns the fit to all runs without the names that do not improve the prediction of unseen ones."""
    model = found.model
    for name, adds in gains.items():
        if not adds.real:
            model = less(evidence, model, name)
    return model
