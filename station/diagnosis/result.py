"""The result of a diagnosis as plain values."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

Verdict = Literal["supported", "not supported", "indistinguishable", "untestable"]

Counted = Literal["runs", "rows", "windows"]

Tested = Literal["channel", "friction", "toppling", "kinds of runs"]
"""The test whose p a place has: of its channel alone, of a smooth term of friction (which onset and slide share), of
toppling, or of two kinds of runs."""

Side = Literal["recording", "simulation", "both"]
"""The side that has an effect: the recording, the simulation that was given, or both."""

READ_IN: Mapping[str, tuple[float, str]] = {
    "1": (1.0, ""),
    "m": (1e3, " mm"),
    "rad": (180.0 / math.pi, "°"),
    "s": (1e3, " ms"),
}
"""The factor and the unit in which people read a number of an SI unit; all others are read as they are."""


def read_name(name: str, unit: str) -> str:
    """Reads a parameter's name without its SI unit, where the number is read in another one.

    It is x for x_m, which is in mm.
    """
    return re.sub(rf"_{unit}(?=_|$)", "", name) if unit in READ_IN else name


def rounded(value: float, digits: int) -> str:
    """Returns a number to so many significant digits as people write it, without a power of ten."""
    return np.format_float_positional(value, precision=digits, unique=False, fractional=False, trim="-")


@dataclass(frozen=True, kw_only=True)
class Value:
    """A number with its standard error, 90 % interval and unit; `at_bound` is True at a bound of its range."""

    value: float
    sd: float
    unit: str
    at_bound: bool = False

    @property
    def interval90(self) -> tuple[float, float]:
        """The central 90 % interval of a Gaussian with this standard error."""
        return self.value - 1.645 * self.sd, self.value + 1.645 * self.sd

    def __str__(self) -> str:
        """Gives the number and its standard error to two digits of the error, the unit, and a note if at its bound."""
        if not math.isfinite(self.value):
            return "–"
        factor, unit = self.read_in
        value, sd = factor * self.value, factor * self.sd
        unit += " (at its bound)" if self.at_bound else ""
        if not math.isfinite(sd) or sd == 0:
            return f"{value:.3g}{unit}"
        digits = max(0, 1 - math.floor(math.log10(sd)))
        return f"{value:.{digits}f} ± {sd:.{digits}f}{unit}"

    def sharper(self, sd: float) -> str:
        """Tells to which standard error (SI) it would be known, and what is known now."""
        factor, unit = self.read_in
        return f"± {factor * sd:.2g}{unit}, now {self}"

    @property
    def read_in(self) -> tuple[float, str]:
        """The factor with which it is read, and the unit behind it."""
        return READ_IN.get(self.unit, (1.0, f" {self.unit}"))


@dataclass(frozen=True, kw_only=True)
class Differs:
    """A number that recording and simulation set differently; `name` is mu_s, or an effect's id and parameter."""

    name: str
    recording: Value
    simulation: Value


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """A stretch of one run of a recording, in its clock's nanoseconds."""

    run: int
    from_ns: int
    to_ns: int


@dataclass(frozen=True, kw_only=True)
class Located:
    """A place where residuals stand out: phase × covariate, with the runs and stretches that stand out most.

    `effect_size` is the root mean square of the smooth part over that of the whole residual; `p` is corrected for the
    whole search of the stage (from 1) that tested it, and `tested` says on what. `curve` has points (covariate, mean
    residual, its standard error) for a plot.
    """

    phase: str
    covariate: str
    channel: str
    effect_size: float
    p: float
    runs: tuple[int, ...]
    windows: tuple[Stretch, ...]
    summary: str
    curve: tuple[tuple[float, float, float], ...] = ()
    stage: int = 1
    tested: Tested = "channel"


@dataclass(frozen=True, kw_only=True)
class Combination:
    """A quantity that is identifiable where single numbers are not, with its standard error in its unit."""

    expression: str
    value: float
    sd: float
    unit: str

    @property
    def known(self) -> Value:
        """The quantity as a number with its error."""
        return Value(value=self.value, sd=self.sd, unit=self.unit)


@dataclass(frozen=True, kw_only=True)
class Acting:
    """The size of an effect in one phase of each run, in units of the spread between equal runs.

    `sizes` are the sizes in the runs with the numbers `runs`; a run that does not show the phase is in neither.
    """

    phase: str
    runs: tuple[int, ...]
    sizes: tuple[float, ...]

    @property
    def median(self) -> float:
        """The median size."""
        return float(np.median(self.sizes))

    @property
    def most(self) -> tuple[int, float]:
        """The run in which it acts most, and its size there."""
        return max(zip(self.runs, self.sizes, strict=True), key=lambda one: one[1])


@dataclass(frozen=True, kw_only=True)
class HeldOutGain:
    """The gain in the prediction of unseen runs by one name beside all others, with standard errors.

    `gain` is in log score (nat) a run, `path` is the decrease of a simulated slide's error (m). Folds that did not find
    the name count as 0; `folds` is the number of those that did.
    """

    gain: Value
    path: Value
    folds: int

    @property
    def real(self) -> bool:
        """True if unseen runs are predicted better beyond the standard error."""
        return self.gain.value > self.gain.sd


@dataclass(frozen=True, kw_only=True)
class EffectFound:
    """An effect of the catalogue, or `other`, with its verdict. `class_ids` cannot be told from each other.

    `determined` are the combinations that are identifiable where single numbers are not; `held_out_gain` is what the
    name adds to the prediction of unseen runs; `separated_by` is the advice that separates the class, and `other_by`
    what `other` in it depends on. `acting` tells in which phases of which runs it acts, by the model that has it.
    `is_series` is True if its parameters say nothing one by one.
    """

    id: str
    title: str
    class_ids: tuple[str, ...]
    probability: float
    verdict: Verdict
    parameters: Mapping[str, Value]
    separated_by: str = ""
    determined: tuple[Combination, ...] = ()
    held_out_gain: HeldOutGain | None = None
    side: Side = "recording"
    other_by: str = ""
    acting: tuple[Acting, ...] = ()
    is_series: bool = False

    @property
    def members(self) -> list[str]:
        """The names of the class; what has none by what it depends on."""
        unnamed = f"a change with the {self.other_by}" if self.other_by else "something without a name"
        return [unnamed if name == "other" else name for name in self.class_ids]


@dataclass(frozen=True, kw_only=True)
class Quality:
    """The quality of predictions of held-out runs; a figure is nan where the recording has no such data.

    `se` has the standard error of each figure by its name.
    """

    log_score: float
    onset_rmse_deg: float
    path_rmse_mm: float
    coverage90: float
    onset_median_deg: float = math.nan
    path_median_mm: float = math.nan
    turn_rmse_deg: float = math.nan
    turn_median_deg: float = math.nan
    se: Mapping[str, float] = field(default_factory=dict[str, float])


@dataclass(frozen=True, kw_only=True)
class FitQuality:
    """The quality before and after, on held-out runs; `floor_onset_deg` is the spread between equal runs.

    `gap_closed` is the gain in log score over the one to expect if the fitted model is right, which is what it gains
    on sessions that are drawn from itself (the ceiling); within its error it may exceed 1. `nested` is True if the
    names, too, were found without the held-out runs.
    """

    before: Quality
    after: Quality
    log_score_gain: float
    gain_se: float
    floor_onset_deg: float
    gap_closed: float
    gap_closed_se: float = math.nan
    ceiling_log_score: float = math.nan
    nested: bool = False
    simulator_rerun: Mapping[str, Any] = field(default_factory=dict[str, Any])

    def changes(self, figure: str) -> bool:
        """Returns true if a figure of `Quality` differs by more than its standard errors together."""
        before, after = (getattr(one, figure) for one in (self.before, self.after))
        errors = (one.se.get(figure, math.nan) for one in (self.before, self.after))
        return abs(before - after) > math.hypot(*errors)

    @classmethod
    def unknown(cls) -> FitQuality:
        """Returns the quality where nothing could be tested: every figure is nan."""
        nan = math.nan
        nothing = Quality(log_score=nan, onset_rmse_deg=nan, path_rmse_mm=nan, coverage90=nan)
        return cls(before=nothing, after=nothing, log_score_gain=nan, gain_se=nan, floor_onset_deg=nan, gap_closed=nan)


@dataclass(frozen=True, kw_only=True)
class NextExperiment:
    """The plan that settles in the least time what the recording leaves open.

    `runs` is 0 and `plan` empty if no plan alone does. `why` has no full stop at its end. `power` is the probability
    that the session's own diagnosis tells the rivals apart, `log_odds` the expected log odds of the true one; `sd` is
    the standard error that is expected of the main number if it stands alone. What does not apply is nan. `changed` are
    the tables of the plan that differ from the recording's. `tells_apart` are the groups of ids that the plan tells
    from each other: within a group it promises nothing. `lockstep` is True if the recording was made in simulated time,
    as the next session is then.
    """

    separates: tuple[tuple[str, ...], ...]
    plan: str
    runs: int
    why: str
    power: float = math.nan
    log_odds: float = math.nan
    minutes: float = math.nan
    sd: float = math.nan
    changed: tuple[str, ...] = ()
    tells_apart: tuple[tuple[str, ...], ...] = ()
    lockstep: bool = False

    def command(self, path: str) -> str:
        """Returns the command that runs the plan file at `path`."""
        return f"station run {'--lockstep ' if self.lockstep else ''}--plan {path}"


@dataclass(frozen=True, kw_only=True)
class Candidates:
    """One row of the comparison table: a candidate's gain over the model before its stage.

    `ids` has `other` for a smooth term; `label` names the candidate for readers. `twice_log_odds` are the BIC gain with
    the prior. `share` is the posterior one among nothing and what was fitted in full, which allows for the misfit of
    laws; it is 0 where only a score is known.
    """

    stage: int
    ids: tuple[str, ...]
    label: str
    twice_gain: float
    parameters: int
    bic: float
    twice_log_odds: float
    fitted: bool
    share: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """The whole answer; the defaults are those of a recording with which nothing can be tested.

    `given` is True if the baseline is a simulation that the user gave, and `differs` are the numbers that both set
    differently. Otherwise the baseline is one constant friction. `counted` is what was counted: a session's runs,
    the rows of a table, or the windows in which rows were averaged. `level` names the level of friction: mu_k where
    nothing but sliding was seen. `left_out` has the number of runs that could not be used by the reason, a verb whose
    subject they are, and `without_onset` that of used runs without an onset.
    """

    recording: str
    total_runs: int
    used_runs: int
    left_out: Mapping[str, int] = field(default_factory=dict[str, int])
    without_onset: Mapping[str, int] = field(default_factory=dict[str, int])
    held_out_runs: int = 0
    simulator: str = "planar"
    mu_s: Value = field(default_factory=lambda: Value(value=math.nan, sd=math.nan, unit="1"))
    scatter: float = math.nan
    global_p: float = 1.0
    verdict: Verdict = "untestable"
    located: tuple[Located, ...] = ()
    effects: tuple[EffectFound, ...] = ()
    other_probability: float = 0.0
    none_probability: float = 0.0
    fit: FitQuality = field(default_factory=FitQuality.unknown)
    next_experiment: NextExperiment | None = None
    candidates_tried: int = 0
    candidates: tuple[Candidates, ...] = ()
    untestable: Mapping[str, str] = field(default_factory=dict[str, str])
    numerics: tuple[Mapping[str, Any], ...] = ()
    notes: tuple[str, ...] = ()
    model: Mapping[str, Any] = field(default_factory=dict[str, Any])
    given: bool = False
    differs: tuple[Differs, ...] = ()
    counted: Counted = "runs"
    level: Literal["mu_s", "mu_k"] = "mu_s"
    seconds: float = math.nan
    versions: Mapping[str, str] = field(default_factory=dict[str, str])

    @property
    def names(self) -> tuple[str, ...]:
        """Ids of the effects that are claimed: supported or indistinguishable."""
        return tuple(effect.id for effect in self.effects if effect.verdict in ("supported", "indistinguishable"))

    @property
    def level_differs(self) -> bool:
        """True if recording and simulation have another level of friction."""
        return any(one.name == "mu_s" for one in self.differs)
