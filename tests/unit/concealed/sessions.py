"""Short sessions in known worlds, with hardly any scatter and noise, so that a law shows run by run."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.concealed.design import Design, Nuisance, Setting
from tests.concealed.measure import to_plate
from tests.concealed.session import RunRecord, SessionRecord, run_session
from tests.concealed.world import NULL, World

Array = NDArray[np.float64]
MASS_KG = 0.00785


def quiet(runs: int = 24, *, world: World = NULL, seed: int = 1, scatter: float = 1e-6, **design: Any) -> SessionRecord:
    """A session of the short protocol without adapting angles, whose runs scatter by next to nothing."""
    usual: dict[str, Any] = {"runs": runs, "adapt_after": 0, "wide_deg": 40.0, "wide_steps": 40}
    plan = Design(**(usual | design))
    nuisance = Nuisance(scatter=scatter, noise_px=1e-4)
    return run_session(Setting(design=plan, nuisance=nuisance, world=world), np.random.default_rng(seed))


def slid(session: SessionRecord) -> list[RunRecord]:
    """The runs with a slip."""
    return [run for run in session.runs if not run.censored]


def mu_of(run: RunRecord) -> float:
    """The friction coefficient that the reported tilt at the true onset stands for."""
    return math.tan(float(run.ride.truths[1]))


def mus(session: SessionRecord) -> Array:
    """`mu_of` of every run with a slip."""
    return np.array([mu_of(run) for run in slid(session)])


def path_of(run: RunRecord, world: World = NULL) -> tuple[Array, Array, Array]:
    """Seconds since the true onset, the centre's way (n, 2) in metres since then, and the tilt, until the detection."""
    done = run.ride
    chosen = (done.frame_at > done.truths[0]) & (done.frame_at <= done.marks[1])
    before = done.frame_at <= done.truths[0]
    centre = to_plate(done.corners_px, world).mean(axis=1)
    tilt = np.interp(done.frame_at, done.attitude_at, done.tilt)
    return (done.frame_at[chosen] - done.truths[0]) / 900.0, centre[chosen] - centre[before][-1], tilt[chosen]


def downhill(run: RunRecord) -> Array:
    """Unit vector down the steepest line."""
    return np.array([math.sin(run.facts.azimuth), -math.cos(run.facts.azimuth)])


def correlation(a: Any, b: Any) -> float:
    """Pearson's."""
    return float(np.corrcoef(np.asarray(a, float), np.asarray(b, float))[0, 1])
