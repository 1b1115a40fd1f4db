"""Fig. 9 in Rerun: every sample at its sliding direction and angle of repose, a colour for each tilting direction.

The unit is the degree of the angle of repose: a dot lies at (θ cos φ, −θ sin φ), since the view's y runs downwards.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from station.friction.direction import Array
from station.friction.drawing import DIRECTION_COLOURS
from station.friction.pairs import Pair
from station.friction.slides import Slides
from station.view import colours

_DOT = -2.5
_RAYS_DEG = 30
_SPANS_DEG = {"folded": 180, "whole": 360}
_LEGEND = {
    "folded": ((-0.85, 0.2), (-0.3, 0.2), (0.3, 0.2), (0.85, 0.2)),
    "whole": ((-0.95, -1.1), (0.95, -1.1), (-0.95, 1.1), (0.95, 1.1)),
}
"""The places of the colours' names, in shares of the plot's radius."""
_RINGS_DEG = (2, 5, 10, 15, 30)


def draw(recording: rr.RecordingStream, root: str, pair: Pair) -> None:
    """Logs the dots below `root`, over the paper's half circle and over the whole one, with rings and rays."""
    slides = _known(pair)
    if not len(slides):
        return
    for name, direction in (("folded", slides.paper_rad), ("whole", slides.object_rad)):
        place = f"{root}/fig9/{name}"
        _grid(recording, place, span_deg=_SPANS_DEG[name], reach_deg=_reach(slides))
        for number, colour in enumerate(DIRECTION_COLOURS):
            chosen = slides.sector == number
            shown = rr.Points2D(
                [_reach(slides) * np.array(_LEGEND[name][number])],
                colors=[_rgb(colour)],
                radii=[_DOT],
                labels=[f"tilted about {number * 90}°"],
                show_labels=True,
            )
            recording.log(f"{place}/legend/{number}", shown, static=True)
            if chosen.any():
                dots = rr.Points2D(
                    _place(direction[chosen], np.degrees(slides.theta_rad[chosen])),
                    colors=[_rgb(colour)],
                    radii=[_DOT],
                    labels=list(_said(slides.where(chosen), direction[chosen])),
                    show_labels=False,  # on hovering
                )
                recording.log(f"{place}/tilted_about_{number * 90}_deg", dots, static=True)


def views(root: str, pair: Pair, *, title: str) -> rrb.Container:
    """Shows the slides folded as the paper has it, and over the whole circle that the mark's identity gives."""
    slides = _known(pair)
    reach = 1.25 * _reach(slides) if len(slides) else 1.0
    bounds = {"folded": (-reach, 0.3 * reach), "whole": (-reach, reach)}
    names = {"folded": "folded to 180°", "whole": "by the mark's identity, 360°"}
    return rrb.Horizontal(
        *(
            rrb.Spatial2DView(
                origin=f"{root}/fig9/{each}",
                name=f"{title}: θ (°) by direction, {names[each]}",
                visual_bounds=rrb.VisualBounds2D(x_range=(-reach, reach), y_range=bounds[each]),
            )
            for each in _SPANS_DEG
        ),
        name=title,
    )


def _known(pair: Pair) -> Slides:
    kept = pair.kept
    return kept.where(np.isfinite(kept.paper_rad))


def _reach(slides: Slides) -> float:
    return 1.05 * math.degrees(slides.theta_rad.max())


def _place(direction_rad: Array, theta_deg: Array) -> Array:
    return np.column_stack([theta_deg * np.cos(direction_rad), -theta_deg * np.sin(direction_rad)])


def _said(slides: Slides, direction_rad: Array) -> Iterator[str]:
    for run, direction, theta in zip(slides.run, np.degrees(direction_rad), np.degrees(slides.theta_rad), strict=True):
        yield f"run {run}: {theta:.2f}° at {direction:.0f}°"


def _rgb(colour: str) -> colours.Colour:
    """Returns a colour of the printed figures, '#rrggbb'."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue


def _grid(recording: rr.RecordingStream, place: str, *, span_deg: int, reach_deg: float) -> None:
    """Draws rings at round angles of repose, rays every 30°, each with its number."""
    step = next((step for step in _RINGS_DEG if reach_deg / step <= 5), _RINGS_DEG[-1])
    radii = np.arange(step, reach_deg, step)
    turn = np.radians(np.linspace(0, span_deg, 2 * span_deg + 1))
    strips = [_place(turn, np.full_like(turn, radius)) for radius in (*radii, reach_deg)]
    rays = np.radians(np.arange(0, span_deg + (span_deg == 180), _RAYS_DEG))
    strips += [_place(np.full(2, ray), np.array([0.0, reach_deg])) for ray in rays]
    lines = rr.LineStrips2D(strips, colors=[colours.QUIET], radii=[colours.LINE / 2], draw_order=-1.0)
    recording.log(f"{place}/grid", lines, static=True)
    under_axis = np.column_stack([radii, np.full_like(radii, 0.06 * reach_deg)])
    ends = np.concatenate([under_axis, _place(rays, np.full_like(rays, 1.12 * reach_deg))])
    words = [f"{radius:g}°" for radius in radii] + [f"{math.degrees(ray):.0f}°" for ray in rays]
    labels = rr.Points2D(ends, labels=words, show_labels=True, colors=[colours.COMMANDED], radii=[-0.5])
    recording.log(f"{place}/numbers", labels, static=True)
