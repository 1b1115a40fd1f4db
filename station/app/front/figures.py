"""The figures of a recording and of its simulation, as pieces of HTML."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from shared.messages import Sample
from station.friction.drawing import DIRECTION_COLOURS
from station.pages.caption import Caption
from station.pages.drawing import AFTER, BEFORE, new_figure, style
from station.pages.figure import drawn
from station.simulators.recorded_runs import Poses

_FREE = "0.4"


def onsets_by_run(samples: Sequence[Sample]) -> str:
    """Returns the tilt at each run's onset, coloured by its direction.

    Runs without a slide and flagged ones are marked.
    """
    with style():
        figure = new_figure(width_in=6.4, height_in=2.6)
        axes = figure.add_subplot()
        for direction in sorted({sample.direction for sample in samples}):
            own = [sample for sample in samples if sample.direction == direction]
            colour = DIRECTION_COLOURS[direction % len(DIRECTION_COLOURS)] if direction >= 0 else _FREE
            label = f"direction {direction}" if direction >= 0 else "free"
            axes.plot(*_onsets([one for one in own if not one.censored]), "o", ms=4, color=colour, label=label)
            axes.plot(*_onsets([one for one in own if one.censored]), "^", ms=4, mfc="none", color=colour)
        flagged = [sample for sample in samples if sample.flags]
        axes.plot(*_onsets(flagged), "x", ms=7, color="0.2", label="flagged" if flagged else None)
        _label(axes)
        caption = Caption(
            shows="Tilt at the onset by run. Hollow triangles: no slide up to this tilt.", count=f"{len(samples)} runs"
        )
        return drawn(figure, caption, name="onsets-by-run", alt="tilt at the onset of each run")


def again(recorded: Sequence[Sample], simulated: Sequence[Sample], paths: tuple[Poses, Poses]) -> str:
    """Returns recorded and simulated onsets by run, and the paths of the block on the plate."""
    with style():
        figure = new_figure(width_in=8.4, height_in=3.0)
        onsets, plate = figure.subplots(1, 2, width_ratios=(3, 2))
        _beside(onsets, recorded, simulated)
        for poses, colour, label in zip(paths, (BEFORE, AFTER), ("recorded", "simulated"), strict=True):
            plate.plot(*(1e3 * poses.pose[:, :2].T), ".", ms=2, color=colour, label=label, rasterized=True)
        plate.set(xlabel="x (mm)", ylabel="y (mm)", aspect="equal", title="block on the plate")
        caption = Caption(
            shows="Recorded and simulated: tilt at the onset of each run, and the places of the block.",
            count=f"{len(recorded)} recorded and {len(simulated)} simulated runs",
        )
        return drawn(figure, caption, name="simulated", alt="recorded and simulated onsets and paths")


def _beside(axes: Any, recorded: Sequence[Sample], simulated: Sequence[Sample]) -> None:
    for samples, colour, label in ((recorded, BEFORE, "recorded"), (simulated, AFTER, "simulated")):
        axes.plot(*_onsets([one for one in samples if not one.censored]), "o", ms=4, color=colour, label=label)
        axes.plot(*_onsets([one for one in samples if one.censored]), "^", ms=4, mfc="none", color=colour)
    _label(axes)


def _onsets(samples: Sequence[Sample]) -> tuple[Any, Any]:
    angles = [math.degrees(sample.onset_angle_rad) for sample in samples]
    return np.array([sample.run for sample in samples]), np.array(angles)


def _label(axes: Any) -> None:
    axes.set(xlabel="run", ylabel="tilt at the onset (°)")
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
