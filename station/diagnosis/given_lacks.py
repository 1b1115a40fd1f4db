"""A given simulation may lack runs of the recording, slides of its blocks, or all that could be compared."""

from __future__ import annotations

import math
from collections.abc import Iterator

from shared.errors import UserError
from station.diagnosis import thresholds
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.result import Diagnosis, rounded
from station.physics.model import Model
from station.signals.session import Signals


def lacks(recorded: Evidence, evidence: Evidence, simulated: object, *, name: str) -> tuple[str, ...]:
    """Returns a sentence for each thing that a simulation, whose `evidence` was taken, lacks of the recording."""
    return tuple(_lacks(recorded, evidence, simulated, name))


def _lacks(recorded: Evidence, evidence: Evidence, simulated: object, name: str) -> Iterator[str]:
    count = _missing(recorded, simulated)
    if count:
        yield f"{name} lacks {count} of the recording's {recorded.runs} runs, which are compared with nothing"
    if recorded.slides is not None and evidence.slides is None:
        yield f"{name} shows no slide, so that none is compared"


def _missing(recorded: Evidence, simulated: object) -> int:
    """Returns the number of the recording's runs that a simulated session does not have."""
    there = set(simulated.runs) if isinstance(simulated, Signals) else None
    return 0 if there is None else len(set(recorded.run_number.astype(int).tolist()) - there)


def refuse_too_few(recorded: Evidence, evidence: Evidence, simulated: object, *, name: str) -> None:
    """Raises a UserError if too few of a simulation's runs can be compared, with the reason."""
    if evidence.used() >= thresholds.LEAST_RUNS:
        return
    why = list(evidence.notes)
    if count := _missing(recorded, simulated):
        why.append(f"it lacks {count} of the recording's {recorded.runs} runs")
    if evidence.total_runs > evidence.used():
        why.append(f"the other {evidence.total_runs - evidence.used()} that it has neither slide nor hold")
    raise UserError(
        f"Expected a simulation with at least {thresholds.LEAST_RUNS:g} runs that can be compared, "
        f"got {evidence.used()} in {name}: {'; '.join(why) or 'it has no more'}"
    )


def all_hold(simulated: Evidence) -> bool:
    """Returns true if no block of a simulation slides: its runs tell lower limits of its friction, and nothing else."""
    return all(channel.rows.limit.all() for channel in simulated.channels if channel.shares_friction)


def least_level(simulated: Evidence, start: Model) -> float:
    """Returns the largest coefficient of friction that is known to have held a block of the simulation."""
    channel = simulated.friction
    assert channel is not None
    return start.mu_s * math.exp(float(channel.residual(start)[channel.rows.limit].max()))


def refuse_without_slides(answer: Diagnosis, simulated: Evidence, *, as_it_is: Evidence, name: str, gave: str) -> None:
    """Raises a UserError if no block of a simulation slides, also where it was `simulated` with less friction.

    The lower limit of its own is taken from the simulation `as_it_is`. `gave` says what the simulator gave for every
    run, where that tells why; empty: it gave paths.
    """
    if not all_hold(simulated):
        return
    least = least_level(as_it_is, Model(mu_s=answer.mu_s.value))
    held = f"{name} {gave}" if gave else f"in {name} the block held in"
    advice = "look whether it returns its path, or give it less friction" if gave else "give it less friction"
    raise UserError(
        f"Expected a simulation in which blocks slide, but {held} each of {as_it_is.used()} runs: its {answer.level} "
        f"is at least {rounded(least, 3)}, that of the recording {answer.mu_s}; {advice}"
    )
