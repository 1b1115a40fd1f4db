"""Do the limit curve's intervals hold what they promise? 200 passive sessions of each kind, printed as a table.

Some four minutes of one core: `pytest -m benchmark tests/benchmarks/test_limit_curve.py`. Every session biases itself
(`tests.recovery.passive_rig`). Bias is the mean error, in per cent of the true value (degrees for an angle), coverage
the share of 90 % intervals that hold the truth, with Wilson's 95 % interval of that share.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest
from numpy.typing import NDArray

from station.friction.limit_curve.choice import choose
from station.friction.limit_curve.curve import Estimate
from station.friction.limit_curve.estimates import estimates_of, friction_at
from station.friction.limit_curve.maximise import Maximum, first_guess, maximise
from station.friction.limit_curve.observations import Observations
from station.friction.limit_curve.parameters import Layout
from station.friction.limit_curve.shape import Frame, Kind
from tests.recovery.passive_rig import Rig, Sessions, ellipse, sessions

pytestmark = pytest.mark.benchmark
SESSIONS, RUNS = 200, 300
HALF_BIN_RAD = math.radians(5.625)
AXIS_RAD = math.radians(30.0)


@dataclass(frozen=True, kw_only=True)
class Planted:
    """A kind of session: what is fitted to it, and the truth of what is estimated, by name; `mu` at directions.

    `chosen`: in how many sessions kind and frame are chosen, too, which takes longer than all the rest.
    """

    title: str
    rig: Rig
    kind: Kind
    frame: Frame = "object"
    truth: dict[str, float] = field(default_factory=dict[str, float])
    at: dict[str, float] = field(default_factory=dict[str, float])
    chosen: int = 12


Mu = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def one_way(mu: Mu) -> Mu:
    """Times 1.1 forwards (60°), by 1.1 less backwards."""

    def both(phi: NDArray[np.float64]) -> NDArray[np.float64]:
        return mu(phi) * np.exp(math.log(1.1) * np.cos(phi - math.radians(60)))

    return both


def uneven(phi: NDArray[np.float64]) -> NDArray[np.float64]:
    """A convex curve with one side higher than the other and three bulges."""
    waves = 0.10 * np.cos(2 * (phi - 0.5)) + 0.06 * np.cos(phi - 1.0) + 0.03 * np.cos(3 * phi) + 0.01 * np.sin(4 * phi)
    return 0.36 * np.exp(waves)


HIGH = {"highest": AXIS_RAD, "lowest": AXIS_RAD + math.pi / 2}
CASES = (
    Planted(
        title="circle, mu 0.36",
        rig=Rig(mu=lambda phi: np.full_like(phi, 0.36)),
        kind="isotropic",
        truth={"level": 0.36, "scatter": 0.1},
        chosen=60,
    ),
    Planted(
        title="ellipse 0.40 : 0.32 fixed to the object",
        rig=Rig(mu=ellipse(0.40, 0.32, AXIS_RAD), excess=0.08),
        kind="ellipse",
        truth={"mu_1": 0.40, "mu_2": 0.32, "axis_rad": AXIS_RAD, "scatter": 0.1},
        at=HIGH,
    ),
    Planted(
        title="ellipse 0.50 : 0.25 fixed to the object, Student's tails (5), arm reaches 28°",
        rig=Rig(mu=ellipse(0.50, 0.25, AXIS_RAD), excess=0.08, tail_dof=5.0, reach_rad=math.radians(28)),
        kind="ellipse",
        truth={"mu_1": 0.50, "mu_2": 0.25, "axis_rad": AXIS_RAD, "scatter": 0.1},
        at=HIGH,
    ),
    Planted(
        title="one-way 1.21 : 1 on an ellipse 0.41 : 0.32, fixed to the plate",
        rig=Rig(mu=one_way(ellipse(0.41, 0.32, AXIS_RAD)), excess=0.08, fixed_to_plate=True),
        kind="one_way",
        frame="plate",
        truth={"one_way": 1.21, "one_way_rad": math.radians(60), "scatter": 0.1},
        at={"forwards": math.radians(45), "backwards": math.radians(225), "across": math.radians(135)},
    ),
    Planted(
        title="neither ellipse nor circle: harmonics 1, 2, 3 and 4, fixed to the object",
        rig=Rig(mu=uneven, excess=0.08),
        kind="general",
        truth={"scatter": 0.1},
        at={f"at {degrees}°": math.radians(degrees) for degrees in (0, 60, 120, 180, 240, 300)},
    ),
)


def wilson(hits: int, number: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a share."""
    z = 1.96
    middle = (hits + z**2 / 2) / (number + z**2)
    width = z / (number + z**2) * math.sqrt(hits * (number - hits) / number + z**2 / 4)
    return middle - width, middle + width


def fitted(case: Planted, runs: Observations) -> Maximum:
    plain = Layout("isotropic", "object")
    start = maximise(plain, runs, start=first_guess(runs), start_layout=plain)
    if case.kind == "isotropic":
        return start
    return maximise(Layout(case.kind, case.frame), runs, start=start.values, start_layout=plain)


def estimated(case: Planted, fit: Maximum) -> dict[str, Estimate]:
    named = estimates_of(fit)
    found = {name: named[name] for name in case.truth}
    return found | {f"mu {name}": friction_at(fit, direction) for name, direction in case.at.items()}


def naive(case: Planted, played: Sessions, direction_rad: float) -> NDArray[np.float64]:
    """The paper's mean of the bin at a direction, for each session that has any sample there."""
    bins = [
        played.naive(number, direction_rad=direction_rad, half_width_rad=HALF_BIN_RAD, plate=case.frame == "plate")
        for number in range(SESSIONS)
    ]
    return np.array([mu.mean() for mu in bins if len(mu)])


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.title)
def test_intervals_cover(case: Planted, capsys: pytest.CaptureFixture[str]) -> None:
    """Prints the table; fails where an interval's coverage cannot be its nominal one by any stretch."""
    played = sessions(case.rig, count=SESSIONS, runs=RUNS, rng=np.random.default_rng(11))
    truth = case.truth | {f"mu {name}": float(case.rig.mu(np.array(at))) for name, at in case.at.items()}
    rows: dict[str, list[Estimate]] = {name: [] for name in truth}
    for number in range(SESSIONS):
        for name, estimate in estimated(case, fitted(case, played.observations(number))).items():
            rows[name].append(estimate)
    censored = float(np.isposinf(played.below).mean())
    lines = [f"{case.title}: {SESSIONS} sessions of {RUNS} runs, {censored:.1%} censored"]
    lines.append(f"  {'':14} {'truth':>8} {'bias':>8} {'sd':>7} {'coverage of 90 %':>22} {'paper, bin mean':>18}")
    for name, estimates in rows.items():
        line, covered = _row(name, truth[name], estimates)
        at = case.at.get(name.removeprefix("mu ")) if name.startswith("mu ") else None
        lines.append(line + ("" if at is None else _naive(naive(case, played, at), truth[name])))
        assert wilson(covered, SESSIONS)[1] > 0.84, line
    kinds = [choose(played.observations(number)) for number in range(case.chosen)]
    right = sum((one.best.layout.kind, one.best.layout.frame) == (case.kind, case.frame) for one in kinds)
    rejected = sum(one.p_isotropic < 0.05 for one in kinds)
    lines.append(
        f"  chosen as planted: {right} of {case.chosen}; p < 0.05 against isotropic: {rejected} of {case.chosen}"
    )
    with capsys.disabled():
        print("\n" + "\n".join(lines))


def _row(name: str, truth: float, estimates: list[Estimate]) -> tuple[str, int]:
    values = np.array([one.value for one in estimates])
    angle = name.endswith("_rad")
    turn = math.pi if name == "axis_rad" else 2 * math.pi
    error = (values - truth + turn / 2) % turn - turn / 2 if angle else values - truth
    half = np.array([one.high - one.value for one in estimates]), np.array([one.value - one.low for one in estimates])
    covered = int(((error <= half[1]) & (-error <= half[0])).sum())
    unit, scale = ("°", 180 / math.pi) if angle else ("%", 100 / truth)
    shown = math.degrees(truth) if angle else truth
    low, high = wilson(covered, SESSIONS)
    return (
        f"  {name:14} {shown:8.3f} {error.mean() * scale:+7.2f}{unit} {error.std() * scale:6.2f}{unit}"
        f" {covered / SESSIONS:8.1%} ({low:.1%}–{high:.1%})",
        covered,
    )


def _naive(means: NDArray[np.float64], truth: float) -> str:
    if not len(means):
        return "   no sample there"
    bias = 100 * (means.mean() / truth - 1)
    return f"   {bias:+6.2f}% in {len(means)} of {SESSIONS}"
