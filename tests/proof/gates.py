"""Every gate, for the cases of one family: what was measured, its interval and number of cases, what is asked."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import kstest

from station.physics.contact import Array
from tests.proof.intervals import bootstrap, wilson
from tests.proof.said import number
from tests.proof.scoring import Scored, of_kind

SEED = 7
"""The seed of the bootstrap."""

MOST_ALARMS = 0.05
BINS = 10
FAR_OFF = 3e-3
"""A held-out loss below this (of a log density per run) on a null is rounding of the refit, not a loss."""


@dataclass(frozen=True, kw_only=True)
class Gate:
    """One row of the table. `low` and `high` bound `value` at 95 %; `least` and `most` are asked for (nan: not).

    `cases` is what the value rests on; without any there is no value, and the gate is neither met nor missed.
    """

    key: str
    title: str
    value: float
    low: float
    high: float
    cases: int
    least: float = math.nan
    most: float = math.nan
    share: bool = True
    asked: str = ""

    @property
    def met(self) -> bool | None:
        """True if the value lies within what is asked; None without a gate or without cases."""
        if not self.asked or not math.isfinite(self.value):
            return None
        return not (self.value < self.least or self.value > self.most)

    @property
    def sure(self) -> bool:
        """True if the whole interval is on the value's side of the gate."""
        return all(
            not (math.isfinite(bound) and self.low < bound < self.high) for bound in (self.least, self.most)
        ) and math.isfinite(self.low)


def share(key: str, title: str, hits: Iterable[bool], **asked: float | str) -> Gate:
    """A share of cases with its Wilson interval."""
    counted = list(hits)
    low, high = wilson(sum(counted), len(counted))
    value = sum(counted) / len(counted) if counted else math.nan
    return Gate(key=key, title=title, value=value, low=low, high=high, cases=len(counted), **asked)  # pyright: ignore[reportArgumentType]  # bounds and text by name


def figure(
    key: str, title: str, values: Iterable[float], statistic: Callable[[Array], float], **asked: float | str
) -> Gate:
    """A statistic of numbers with its bootstrap interval; what does not exist is left out."""
    known = np.array([value for value in values if math.isfinite(value)])
    low, high = bootstrap(known, statistic, rng=np.random.default_rng(SEED))
    value = statistic(known) if len(known) else math.nan
    return Gate(key=key, title=title, value=value, low=low, high=high, cases=len(known), share=False, **asked)  # pyright: ignore[reportArgumentType]  # bounds and text by name


def gates(cases: Sequence[Scored]) -> list[Gate]:
    """All rows, in the table's order."""
    return [
        *_of_nulls(cases),
        *_of_names(cases),
        *_of_places_and_numbers(cases),
        *_of_predictions(cases),
        *_of_doubts(cases),
        *_of_time(cases),
    ]


def _of_nulls(cases: Sequence[Scored]) -> list[Gate]:
    plain = of_kind(cases, "null")
    told = [number(one.said.answer.get("global_p")) for one in plain if one.said.fault is None]
    return [
        share(
            "false_alarms",
            "false alarms on nulls: anything claimed",
            (one.alarmed for one in plain),
            most=MOST_ALARMS,
            asked="≤ 5 %",
        ),
        share("null_p", "nulls with a global p < 0.05", (one.significant for one in plain)),
        uniformity([p for p in told if math.isfinite(p)]),
        share("null_loss", "held-out loss on nulls", (one.gain < -FAR_OFF for one in plain), most=0.0, asked="never"),
        share(
            "artefact_alarms",
            "artefacts of a simulator called physics",
            (one.alarmed for one in of_kind(cases, "artefact")),
        ),
    ]


def _of_names(cases: Sequence[Scored]) -> list[Gate]:
    strong = [one for one in of_kind(cases, "single") if one.strong]
    pairs = of_kind(cases, "pair")
    return [
        share(
            "first",
            "strong singles: right name first",
            (one.right_first for one in strong),
            least=0.92,
            asked="≥ 92 %",
        ),
        share(
            "class",
            "strong singles: truth in a claimed class",
            (one.right_class for one in strong),
            least=0.95,
            asked="≥ 95 %",
        ),
        share("missed", "strong singles: nothing claimed", (not one.alarmed for one in strong)),
        share("sure_wrong", "strong singles: a wrong name without doubt", (one.wrongly_confident for one in strong)),
        share("both", "both effects of a pair named", (one.both for one in pairs), least=0.8, asked="≥ 80 %"),
        share("both_strong", "the same, where both are strong", (one.both for one in pairs if one.strong)),
        share("both_class", "both effects of a pair within claimed classes", (one.right_class for one in pairs)),
    ]


def _of_places_and_numbers(cases: Sequence[Scored]) -> list[Gate]:
    strong = [one for one in of_kind(cases, "single", "pair") if one.strong]
    pulls = [pull for one in of_kind(cases, "single", "pair") for pull in one.pulls()[0]]
    z = [pull.z for pull in pulls]
    return [
        figure(
            "place",
            "place, area under the curve, strong singles and pairs",
            (value for one in strong for value in one.aucs()),
            _mean,
            least=0.9,
            asked="≥ 0.9",
        ),
        figure(
            "acting",
            "where effects act, by the sizes that the tool gives them (not named: 0.5), area under the curve",
            (value for one in strong for value in one.acting_aucs()),
            _mean,
        ),
        figure("z_sd", "parameters: sd of the z-scores about zero", z, _sd, least=0.85, most=1.2, asked="0.85 … 1.2"),
        figure("z_robust", "parameters: sd of the z-scores from their quartiles", z, _robust_sd),
        share(
            "coverage",
            "parameters: 90 % intervals that hold the truth",
            (pull.covered for pull in pulls),
            least=0.85,
            most=0.95,
            asked="85 … 95 %",
        ),
    ]


def _of_predictions(cases: Sequence[Scored]) -> list[Gate]:
    """Returns the gates of the predictions of runs that the fits have not seen."""
    right = [one for one in of_kind(cases, "single") if one.strong and one.right_first]
    onset, path = ([one.falls(name) for one in right] for name in ("onset_rmse_deg", "path_rmse_mm"))
    return [
        figure(
            "gap",
            "share of the recoverable gap closed, median",
            (one.gap_closed for one in of_kind(cases, "single", "pair")),
            _median,
            least=0.8,
            asked="≥ 0.8",
        ),
        share(
            "onset_falls",
            "error of unseen onsets falls, after a right name",
            (bool(one) for one in onset if one is not None),
        ),
        share(
            "path_falls",
            "error of unseen re-simulated paths falls, after a right name",
            (bool(one) for one in path if one is not None),
            least=0.95,
            asked="≥ 95 %",
        ),
        share(
            "path_rises",
            "unseen paths get better by two standard errors once the right name is left out",
            (without for one in right if (without := one.paths_better_without) is not None),
        ),
    ]


def _of_doubts(cases: Sequence[Scored]) -> list[Gate]:
    blind, confounded = of_kind(cases, "confounded", "absorbed"), of_kind(cases, "confounded")
    outside, absorbed = of_kind(cases, "outside"), of_kind(cases, "absorbed")
    statements = [statement for one in cases for statement in one.statements()]
    return [
        share(
            "confident",
            "confident wrong name, confounded or absorbed",
            (one.wrongly_confident for one in blind),
            most=0.05,
            asked="≤ 5 %",
        ),
        share(
            "next", "right next experiment, confounded", (one.advised for one in confounded), least=0.8, asked="≥ 80 %"
        ),
        share("untestable", "absorbed: said to be untestable, with what it takes", (one.explained for one in absorbed)),
        share(
            "outside", "outside the catalogue: located", (one.located for one in outside), least=0.85, asked="≥ 85 %"
        ),
        share(
            "misnamed",
            "outside the catalogue: wrongly named",
            (one.wrongly_named for one in outside),
            most=0.1,
            asked="≤ 10 %",
        ),
        calibration(statements),
    ]


def uniformity(values: Sequence[float]) -> Gate:
    """The p of Kolmogorov and Smirnov for the nulls' global p, which are uniform where their nulls are right."""
    p = float(kstest(values, "uniform").pvalue) if values else math.nan
    title = "nulls: global p uniform (p of Kolmogorov-Smirnov)"
    return Gate(
        key="null_ks", title=title, value=p, low=math.nan, high=math.nan, cases=len(values), least=0.01, share=False,
        asked="> 0.01",
    )  # fmt: skip


def calibration(statements: Sequence[tuple[float, bool]]) -> Gate:
    """Expected calibration error of all probabilities that were said of a claim."""
    rows = np.array([(said, float(right)) for said, right in statements if math.isfinite(said)]).reshape(-1, 2)
    low, high = bootstrap(rows, calibration_error, rng=np.random.default_rng(SEED))
    return Gate(
        key="calibration",
        title="expected calibration error of the probabilities",
        value=calibration_error(rows) if len(rows) else math.nan,
        low=low,
        high=high,
        cases=len(rows),
        most=0.05,
        share=False,
        asked="≤ 0.05",
    )


def calibration_error(rows: Array) -> float:
    """Mean over ten bins of |share that is right − mean probability|, weighted by their sizes; rows (n, 2)."""
    return sum(weight * abs(right - said) for said, right, weight in reliability(rows))


def reliability(rows: Array) -> list[tuple[float, float, float]]:
    """The mean probability of each bin that has any, its share that is right, and its share of all statements."""
    number = np.clip((rows[:, 0] * BINS).astype(int), 0, BINS - 1)
    return [
        (float(mine[:, 0].mean()), float(mine[:, 1].mean()), len(mine) / len(rows))
        for mine in (rows[number == bin_] for bin_ in range(BINS))
        if len(mine)
    ]


def _of_time(cases: Sequence[Scored]) -> list[Gate]:
    done = [one for one in cases if one.said.fault is None]
    return [
        figure("seconds", "seconds per case, median", (one.said.wall_s for one in done), _median),
        figure(
            "seconds_200",
            "seconds for 200 runs, median",
            (one.said.wall_s * 200 / one.said.runs for one in done if one.said.runs),
            _median,
            most=60.0,
            asked="≤ 60 s",
        ),
        share("faults", "faults of the tool", (one.said.fault is not None for one in cases), most=0.0, asked="none"),
    ]


def _mean(values: Array) -> float:
    return float(np.mean(values))


def _median(values: Array) -> float:
    return float(np.median(values))


def _sd(values: Array) -> float:
    """Returns the standard deviation about zero: a bias counts as well."""
    return float(np.sqrt(np.mean(values**2))) if len(values) > 1 else math.nan


def _robust_sd(values: Array) -> float:
    return float(np.subtract(*np.quantile(values, [0.75, 0.25])) / 1.349) if len(values) > 3 else math.nan
