"""The choice of the design that in the least time tells the rivals apart, or narrows a number's interval."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from station.diagnosis.inference.columns import Scores
from station.diagnosis.next_experiment.changes import Changes, designs, run_s, together
from station.diagnosis.next_experiment.outlook import (
    Drawn,
    Groups,
    Look,
    Outlook,
    Question,
    Trial,
    all_candidates,
    drawn,
    fewest_candidates,
    outlook,
    signal,
    tried,
)
from station.diagnosis.next_experiment.redone import Draw, Recorded, redone
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.plate import Times

POWER = 0.8
"""A session is long enough if it tells the rivals apart with this probability: the usual convention (Cohen 1988)."""
LENGTHS = (20, 30, 40, 60, 80, 120, 160, 240, 320, 480, 720, 1000)
"""The numbers of runs that are tried: nothing is said of fewer, and nobody records more for one question."""
WORTH = 0.9
"""A change has to save a tenth of the time: the session that was done is the one that is known to work."""
SETTINGS = ("dwell_s", "rate", "mass_kg", "mount", "yaw")
"""The quantities that a protocol sets: they come again in random order, whatever the order was."""
TRIAL_RUNS = 60
"""The runs of a session that is done again on paper: of 4 values each has 15."""
SEED = 7
NOTHING = Outlook(power=0.0, log_odds=0.0)


@dataclass(frozen=True, eq=False, kw_only=True)
class Bench:
    """A recorded session, and the share of its runs that could be used."""

    recorded: Recorded
    usable: float = 1.0


@dataclass(frozen=True, eq=False, kw_only=True)
class Choice:
    """A design with its number of runs, the time they take, and what they promise.

    `sd_ratio` is what is left of a number's standard error, as a share of the recorded one.
    """

    changes: Changes
    runs: int
    minutes: float
    promise: Outlook
    groups: Groups = ()
    sd_ratio: float = math.nan


def separating(question: Question, bench: Bench) -> Choice:
    """Returns the design that tells the rivals apart in the least time; if none does, the one with the largest promise.

    Where no design tells all of them apart, one of them is told from the rest.
    """
    known = _Known(question, bench), _Known(question, bench, fewest_candidates)
    partitions = [[(name,) for name in question.ids], *_one_and_rest(question)]
    best = [_among(*known, groups) for groups in partitions[:1]]
    if best[0].promise.power < POWER:
        best += [_among(*known, groups) for groups in partitions[1:]]
    return next((one for one in best if one.promise.power >= POWER), best[0])


def _one_and_rest(question: Question) -> Iterator[Groups]:
    """Yields each rival against all others together, if there are more than two."""
    ids = question.ids
    if len(ids) > 2:
        yield from ([(name,), tuple(other for other in ids if other != name)] for name in ids)


class _Known:
    """The sessions of each design and number of runs, which answer every partition of the rivals."""

    def __init__(self, question: Question, bench: Bench, look: Look = all_candidates) -> None:
        self.question, self.bench, self._look = question, bench, look
        self._trials: dict[tuple[Changes, int], list[Trial]] = {}
        self._drawn: dict[tuple[Changes, int, int], list[Drawn]] = {}

    def promise(self, changes: Changes, runs: int, groups: Groups, *, done: int = TRIAL_RUNS) -> Outlook:
        """Returns the outlook of `runs` runs of a design, computed from `done` simulated runs of it."""
        key = changes, runs, done
        if key not in self._drawn:
            count, rng = runs * self.bench.usable, np.random.default_rng(SEED)
            self._drawn[key] = drawn(self._done(changes, done), runs=count, rng=rng)
        return outlook(self._drawn[key], groups)

    def _done(self, changes: Changes, runs: int) -> list[Trial]:
        if (changes, runs) not in self._trials:
            self._trials[changes, runs] = sessions(self.question, self.bench, changes, runs=runs, look=self._look)
        return self._trials[changes, runs]


def _among(known: _Known, at_best: _Known, groups: Groups) -> Choice:
    """Returns the best design for one partition; where none does alone, the most promising is tried with each other."""
    choices = _quickest(known, at_best, groups, designs())
    if not any(one.promise.power >= POWER for one in choices):
        best = max((one for one in choices if one.changes), key=lambda one: one.promise.log_odds)
        choices += _quickest(known, at_best, groups, together(best.changes[0]))
    return _confirmed(known, _best(choices))


def _quickest(known: _Known, at_best: _Known, groups: Groups, wanted: Iterable[Changes]) -> list[Choice]:
    """Returns the designs in their order, each with its shortest session.

    Of those that do not promise enough even at best, that is all there is to know; and those are left out that take
    longer at best than another one that promises enough.
    """
    most = {changes: _shortest(at_best, changes, groups) for changes in wanted}
    found: dict[Changes, Choice] = {}
    for changes in sorted(most, key=lambda one: _worth(most[one])):
        enough = [_worth(one) for one in found.values() if one.promise.power >= POWER]
        if most[changes].promise.power < POWER:
            found[changes] = most[changes]
        elif not enough or _worth(most[changes]) <= min(enough):
            found[changes] = _shortest(known, changes, groups)
    return [found[changes] for changes in most if changes in found]


def narrowing(question: Question, bench: Bench, *, ratio: float) -> Choice | None:
    """Returns the fastest design that makes the standard error of the only rival's number `ratio` of what it is.

    None if none does.
    """
    known = _information(_signal(question, bench, ()), len(bench.recorded.runs))
    choices = list[Choice]()
    for changes in designs():
        done = _signal(question, bench, changes)
        enough = [runs for runs in LENGTHS if known <= ratio**2 * _information(done, runs * bench.usable)]
        if enough:
            sharper = known / _information(done, enough[0] * bench.usable)
            choice = _choice(question, bench, changes, (enough[0], NOTHING))
            choices.append(replace(choice, sd_ratio=math.sqrt(sharper)))
    return min(choices, key=_worth, default=None)


def _signal(question: Question, bench: Bench, changes: Changes) -> Scores:
    return signal(question, _done(question, bench, changes, TRIAL_RUNS)[0])


def _information(signal: Scores, runs: float) -> float:
    """Returns the information of so many runs about the signal's number."""
    return float(signal.in_runs(runs).information[0, 0])


def _best(choices: Sequence[Choice]) -> Choice:
    enough = [one for one in choices if one.promise.power >= POWER]
    return min(enough, key=_worth) if enough else max(choices, key=lambda one: one.promise.power)


def _worth(choice: Choice) -> float:
    return choice.minutes * (1.0 if choice.changes else WORTH)


def _shortest(known: _Known, changes: Changes, groups: Groups) -> Choice:
    """Returns the shortest session of a design that promises enough, else the longest."""

    def power(runs: int) -> float:
        return known.promise(changes, runs, groups).power

    # More runs tell more, so bisection finds the shortest session.
    index = bisect_left(LENGTHS[:-1], POWER, key=power) if power(LENGTHS[-1]) >= POWER else -1
    promised = LENGTHS[index], known.promise(changes, LENGTHS[index], groups)
    return _choice(known.question, known.bench, changes, promised, groups)


def _confirmed(known: _Known, choice: Choice) -> Choice:
    """Returns the choice with its own number of runs done again.

    What drifts with the runs drifts farther in more of them.
    """
    changes, groups = choice.changes, choice.groups
    longer = [runs for runs in LENGTHS if runs >= choice.runs]
    promises = ((runs, known.promise(changes, runs, groups, done=runs)) for runs in longer)
    return _choice(known.question, known.bench, changes, _first(promises), groups)


Promised = tuple[int, Outlook]
"""A number of runs, and what they promise."""


def _first(promises: Iterable[Promised]) -> Promised:
    """Returns the first that promises enough, or else the last."""
    last: Promised = (0, NOTHING)
    for last in promises:
        if last[1].power >= POWER:
            break
    return last


def _choice(question: Question, bench: Bench, changes: Changes, promised: Promised, groups: Groups = ()) -> Choice:
    runs, promise = promised
    tilt_rad = math.atan(question.beside.mu_s)
    seconds = run_s(protocol_of(bench.recorded, changes, runs=TRIAL_RUNS)[1], tilt_rad=tilt_rad, changes=changes)
    return Choice(changes=changes, runs=runs, minutes=runs * seconds / 60.0, promise=promise, groups=groups)


def sessions(
    question: Question, bench: Bench, changes: Changes, *, runs: int, look: Look = all_candidates
) -> list[Trial]:
    """Returns the session with the changes, once for each rival as its truth."""
    return tried(question, _done(question, bench, changes, runs), look)


def _done(question: Question, bench: Bench, changes: Changes, runs: int) -> list[Evidence]:
    """Returns the evidence of a session with the changes, for each rival as its truth."""
    picked, draw = protocol_of(bench.recorded, changes, runs=runs)
    truths = [question.beside.with_term(rival.term) for rival in question.rivals]
    return redone(bench.recorded, picked, draw, truths=truths)


def protocol_of(recorded: Recorded, changes: Changes, *, runs: int) -> tuple[Times, Draw]:
    """Returns the indices (TRIAL_RUNS,) of recorded runs, and the protocol of a session of `runs` runs as changed."""
    before, rng = recorded.protocol(), np.random.default_rng(SEED)
    picked = np.linspace(0, len(recorded.runs) - 1, TRIAL_RUNS).round().astype(np.int64)
    draw = {name: values[picked] for name, values in before.items()}
    draw["number"] = np.arange(TRIAL_RUNS, dtype=np.float64) * (runs / TRIAL_RUNS)
    for name in SETTINGS:
        draw[name] = rng.permutation(draw[name])
    for change in changes:
        change.vary(rng, TRIAL_RUNS, draw)
    return picked, draw
