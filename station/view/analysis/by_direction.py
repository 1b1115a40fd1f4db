"""Fig. 7 in Rerun: mean and standard deviation of the angle of repose in 32 bins of direction, and their sizes."""

from __future__ import annotations

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from station.friction.bins import Bins, by_direction
from station.friction.drawing import LEAST_MARGIN_DEG
from station.friction.pairs import Pair
from station.view import colours

DIRECTION = "direction_deg"
"""The timeline that stands for the direction. It knows whole numbers only; the bar chart has the bins' exact places."""
_MEAN, _COUNT = "fig7/mean", "fig7/samples"


def bins_of(pair: Pair) -> Bins:
    """Returns the bins of the kept slides' angles of repose in degrees, folded to 180° as the paper does."""
    return by_direction(pair.kept.paper_rad, np.degrees(pair.kept.theta_rad))


def draw(recording: rr.RecordingStream, root: str, pair: Pair) -> None:
    """Logs the bins below `root`: means with variances along `DIRECTION`, the numbers of samples as bars."""
    bins = bins_of(pair)
    middle_deg = np.degrees(bins.middle_rad)
    width_deg = 180.0 / len(middle_deg)
    bars = rr.BarChart(bins.count, abscissa=middle_deg, widths=[width_deg] * len(middle_deg), color=colours.COMMANDED)
    recording.log(f"{root}/{_COUNT}", bars, static=True)
    if not bins.count.any():
        return
    looks = rr.Measurements.columns(colors=[colours.TILT], widths=[2.0], names=["θ, band: 1 sd"], units=["°"])
    recording.send_columns(f"{root}/{_MEAN}", indexes=[], columns=looks)
    # Nothing at both ends, so that the axis begins at 0 and ends at 180. A bin without samples breaks the line.
    places = rr.TimeColumn(DIRECTION, sequence=[0, *np.rint(middle_deg).astype(int).tolist(), 180])
    # One sample has a mean and no band.
    variances = np.where(np.isnan(bins.sd), 0.0, bins.sd**2)
    values = rr.Measurements.columns(
        values=np.pad(bins.mean, 1, constant_values=np.nan), variances=np.pad(variances, 1)
    )
    recording.send_columns(f"{root}/{_MEAN}", indexes=[places], columns=values)


def views(root: str, pair: Pair, *, title: str) -> rrb.Container:
    """Shows the band above, the numbers of samples below."""
    bins = bins_of(pair)
    spread = np.where(np.isnan(bins.sd), 0.0, bins.sd)
    low, high = (0.0, 1.0) if not bins.count.any() else (np.nanmin(bins.mean - spread), np.nanmax(bins.mean + spread))
    margin = max(0.5 * (high - low), LEAST_MARGIN_DEG)
    band = rrb.TimeSeriesView(
        origin=f"{root}/{_MEAN}",
        name=f"{title}: θ (°) by direction against the object (°)",
        axis_y=rrb.ScalarAxis(range=(max(0.0, low - margin), high + margin)),
        plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop),
    )
    bars = rrb.BarChartView(
        origin=f"{root}/{_COUNT}", name="Samples in each bin", plot_legend=rrb.PlotLegend(visible=False)
    )
    return rrb.Vertical(band, bars, row_shares=[3, 1], name=title)
