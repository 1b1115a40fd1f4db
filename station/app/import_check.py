"""Says of an imported recording whether it can be diagnosed, and which effects it cannot show."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator

from station.app.setting import setting_of
from station.app.simulating import rig_of
from station.diagnosis.answer import why_not
from station.diagnosis.inference.fit import fit
from station.diagnosis.inference.level import levelled
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.search.untestable import untestable
from station.physics.catalogue import catalogue_of_table
from station.physics.model import Model
from station.recording.arrays import load_signals
from station.recording.reader import RecordingReader


def checked(reader: RecordingReader) -> Iterator[str]:
    """Yields the lines: what is wrong with the recording as a whole, or each reason with the effects that it hides."""
    rig = rig_of(reader)
    evidence = evidence_of(load_signals(reader), setting_of(rig))
    why = why_not(evidence)
    if why:
        yield f"It cannot be diagnosed: {why}."
        return
    yield f"It can be diagnosed: {evidence.used()} of {evidence.total_runs} runs have an onset or a slide."
    effects = [effect for effect in catalogue_of_table(rig.physics).values() if effect.layer != "numerics"]
    null = fit(evidence, levelled(evidence, Model(mu_s=0.4)), ())
    hidden = defaultdict[str, list[str]](list)
    for effect, reason in untestable(evidence, null, effects).items():
        hidden[reason].append(effect)
    for reason, names in hidden.items():
        yield f"Untestable: {', '.join(names)}: {reason}"
