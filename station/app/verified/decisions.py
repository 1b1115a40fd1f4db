"""Derives the session's decisions and samples again from the recorded messages, with the plan and rig beside them."""

from __future__ import annotations

from collections.abc import Sequence

from shared.errors import UserError
from station.app.recorded_machine import machine_of
from station.app.recordings import other_rule
from station.app.verified.part import Mismatch, Part
from station.recording.reader import RecordingReader
from station.sampling.machine import INPUTS
from station.sampling.replay import DECISIONS, Difference, Verdict, replay

COMMANDS, EVENTS, SAMPLES = DECISIONS


def parts(reader: RecordingReader) -> Sequence[Part]:
    """Returns the parts `decisions` and `samples`."""
    try:
        machine = machine_of(reader)
    except UserError as error:
        return [Part(name, "not derived", 0, str(error)) for name in ("decisions", "samples")]
    stream = ((item.topic, item.message, item.log_ns) for item in reader.messages({*INPUTS, *DECISIONS}))
    verdicts = replay(machine, stream)
    decided = {topic: verdicts[topic] for topic in (COMMANDS, EVENTS)}
    samples, why = {SAMPLES: verdicts[SAMPLES]}, other_rule(reader)
    return [_compared("decisions", decided, why=why), _compared("samples", samples, why=why)]


def _compared(name: str, verdicts: dict[str, Verdict], *, why: str) -> Part:
    """Compares decisions; `why` those of an honest recording may differ, too, is said where they do."""
    count = sum(verdict.decisions for verdict in verdicts.values())
    found = [_mismatch(topic, verdict.difference) for topic, verdict in verdicts.items() if verdict.difference]
    if not found:
        return Part(name, "identical", count, f"all {count} follow from the recorded messages")
    said = "; ".join(filter(None, (f"after {count} that follow", why)))
    return Part(name, "different", count, said, min(found, key=lambda one: one.stamp_ns))


def _mismatch(topic: str, difference: Difference) -> Mismatch:
    name, recorded, derived = difference.changed
    return Mismatch(topic, difference.stamp_ns, name, recorded, derived)
