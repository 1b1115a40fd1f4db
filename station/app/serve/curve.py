"""The friction of a running session by direction, and its limit curve, which is fitted anew as samples come."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from shared.messages import CameraGeometry, Sample
from station.friction.limit_curve.observations import Observations, observations_of
from station.friction.limit_curve.of_pair import chosen_curve
from station.friction.pairs import Pair, Session, pairs_of

Taken = tuple[int, list[Sample], CameraGeometry | None]
_LOOK_S = 0.5
_REST = 4.0
"""A fit is followed by a rest of this many times its length, so that it takes at most a fifth of one processor."""
_PHI = np.linspace(0.0, 2.0 * math.pi, 73)


class LiveCurve:
    """Works it out on a thread of its own. `state` is the newest, for the page; `version` counts."""

    def __init__(self, samples: Callable[[], Taken]) -> None:
        self._samples = samples
        self._closing = threading.Event()
        self._seen = (0, 0)
        self.version = 0
        self.state: dict[str, Any] = {}
        self._thread = threading.Thread(target=self._run, name="curve", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Ends the thread after the fit under way."""
        self._closing.set()

    def _run(self) -> None:
        while not self._closing.wait(_LOOK_S):
            session, samples, geometry = self._samples()
            if (session, len(samples)) == self._seen:
                continue
            self._seen = (session, len(samples))
            self._tell(session, samples, geometry, fitted=False)
            begin = time.monotonic()
            self._tell(session, samples, geometry, fitted=True)
            self._closing.wait(_REST * (time.monotonic() - begin))

    def _tell(self, session: int, samples: Sequence[Sample], geometry: CameraGeometry | None, *, fitted: bool) -> None:
        try:
            state = friction_of(samples, geometry, fitted=fitted)
        except Exception as error:  # whatever a message held: the page goes on without a curve, and says why
            state = {"points": [], "curve": [], "frame": "object", "note": f"no curve: {error}"}
        self.state = state | {"session": session}
        self.version += 1


def friction_of(samples: Sequence[Sample], geometry: CameraGeometry | None, *, fitted: bool) -> dict[str, Any]:
    """Returns the friction that holds the block against a pull, by the pull's direction.

    Args:
        samples: of one object on one plate; of several pairs the last sample's counts.
        geometry: the camera's, without which there are no directions.
        fitted: whether to fit the curve, which takes about a second for a hundred samples.

    Returns:
        `points` (direction in rad, friction, and whether the run ended without a slide), `curve` (direction, friction),
        `frame` (object or plate, against which directions are) and `note`, which says why there is no curve.
    """
    pair = _pair(samples, geometry)
    if pair is None:
        return {"points": [], "curve": [], "frame": "object", "note": "no samples yet"}
    runs = observations_of(pair)
    if not fitted:
        return {"points": _points(runs, "object"), "curve": [], "frame": "object", "note": "fitting the limit curve"}
    try:
        best = chosen_curve(pair).best
    except ValueError as error:
        return {"points": _points(runs, "object"), "curve": [], "frame": "object", "note": str(error)}
    frame = "plate" if best.layout.frame == "plate" else "object"
    force = best.layout.curve(best.values).force(_PHI)
    curve = [[round(float(phi), 4), round(float(mu), 5)] for phi, mu in zip(_PHI, force, strict=True)]
    return {"points": _points(runs, frame), "curve": curve, "frame": frame, "note": ""}


def _pair(samples: Sequence[Sample], geometry: CameraGeometry | None) -> Pair | None:
    kept = [sample for sample in samples if not sample.disturbed]
    if not kept:
        return None
    last = kept[-1]
    alike = [one for one in kept if (one.object, one.plate) == (last.object, last.plate)]
    return pairs_of([Session(alike, geometry, "live")])[0]


def _points(runs: Observations, frame: str) -> list[list[float | bool]]:
    towards = runs.towards_plate_rad if frame == "plate" else runs.towards_object_rad
    censored = runs.censored
    mu = np.exp(np.where(censored, runs.above, runs.pull))
    rows = zip(towards, mu, censored, strict=True)
    return [
        [round(float(phi), 4), round(float(value), 5), bool(no_slide)]
        for phi, value, no_slide in rows
        if math.isfinite(phi) and math.isfinite(value)
    ]
