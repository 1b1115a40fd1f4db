"""Fig. 8 in Rerun: the mean angle of repose by the place before the slide, a tensor of patches of 10 x 10 pixels."""

from __future__ import annotations

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from station.friction.bins import PATCH_PX, heat_map
from station.friction.direction import Array
from station.friction.drawing import LEAST_RANGE_DEG, centres_px, image_size_px
from station.friction.pairs import Pair

_PATCHES = "fig8/patches"


def patches_of(pair: Pair) -> Array:
    """Returns the mean θ (°) of the kept slides in each patch, (rows, columns).

    They are 0 where there is no sample, as in the paper.
    """
    kept = pair.kept
    means = heat_map(centres_px(kept.pre_px), np.degrees(kept.theta_rad), size_px=image_size_px(pair.slides))
    return np.nan_to_num(means, nan=0.0)


def draw(recording: rr.RecordingStream, root: str, pair: Pair) -> None:
    """Logs the tensor below `root`."""
    patches = patches_of(pair)
    low, high = _range(patches)
    # The scale begins below the lowest value, so that no patch with samples is as black as one without.
    floor = low - 0.25 * max(high - low, LEAST_RANGE_DEG)
    names = [f"y / {PATCH_PX} px", f"x / {PATCH_PX} px"]
    tensor = rr.Tensor(patches.astype(np.float32), dim_names=names, value_range=(floor, max(high, floor + 1e-4)))
    recording.log(f"{root}/{_PATCHES}", tensor, static=True)


def view(root: str, pair: Pair, *, title: str) -> rrb.View:
    """Returns the tensor with a colour for each angle; its name has the scale, which the viewer does not draw."""
    low, high = _range(patches_of(pair))
    return rrb.TensorView(
        origin=f"{root}/{_PATCHES}",
        name=f"{title}: θ by place, {low:.2f}° (dark) to {high:.2f}° (bright); black: no sample",
        scalar_mapping=rrb.TensorScalarMapping(colormap="Inferno", mag_filter="Nearest"),
        view_fit="FillKeepAspectRatio",
    )


def _range(patches: Array) -> tuple[float, float]:
    found = patches[patches > 0]
    return (float(found.min()), float(found.max())) if len(found) else (0.0, 0.0)
