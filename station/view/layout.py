"""Lays everything out on the screen. Views that would stay empty are left out."""

from __future__ import annotations

import math
from collections.abc import Collection

import rerun as rr
import rerun.blueprint as rrb

from shared.topics import ANGLE_PREFIX
from station.view import entities
from station.view.entities import ELAPSED
from station.view.setup import Setup

_LIVE_WINDOW_S = 30.0
_ASIDE_DEG = -35.0
_TILT = "Tilt (°): measured (blue), commanded (grey), slip onset (red)"
_CORNERS = "corners' threshold of a slip (red)"
_BLOCK = "Block (mm): slide (orange), height (blue)"
_BLOCK_BESIDE = "Block: slide, recorded (orange) and simulated before (grey) and after (green); height (blue); mm"
"""Names say the colours: a low panel is full of curves, and its legend would cover some in each of its corners."""
_DISPLACEMENT_RANGE_PX = (0.0, 110.0)
"""Thresholds reach 78 px at 68°. The viewer numbers powers of ten alone where a panel is low: 0 and 100 have to be in
it (`station replay tests/golden/session.mcap --screenshot out.png`)."""


def layout(topics: Collection[str], *, setup: Setup, live: bool = False, diagnosed: bool = False) -> rrb.Blueprint:
    """Returns the blueprint for a session with these topics.

    `live` follows the present and shows the last 30 s of curves; `diagnosed` has a page for the diagnosis, and the
    block's slide beside the simulated ones.
    """
    camera = "camera/corners" in topics or "camera/image" in topics
    upper: list[rrb.View | rrb.Container] = [_scene(setup, arm="arm/joints" in topics)]
    if camera:
        upper.insert(0, _camera(setup))
    window = _window() if live else None
    shares = [5 if diagnosed else 4]
    curves: list[rrb.View | rrb.Container] = [_tilt(topics, window, corners_below=camera and not diagnosed)]
    block = _curves("plots/block", _BLOCK_BESIDE if diagnosed else _BLOCK, window)
    if diagnosed:  # the marked stretches need the room of a row: the corners stand behind the block
        curves.append(rrb.Tabs(block, _displacement(window, name=f"Corners (px); {_CORNERS}")) if camera else block)
        shares.append(4)
    elif camera:
        curves.append(_displacement(window))
        shares.append(5)
    if "block/pose" in topics and not diagnosed:
        curves.append(block)
        shares.append(4)
    states = rrb.StateTimelineView(origin="state", name="What was going on", time_view=_linked())
    lower = rrb.Vertical(*curves, states, row_shares=[*shares, 12 if diagnosed else 5])
    runs = rrb.TextDocumentView(origin=entities.SAMPLES, name="Runs")
    diagnosis = rrb.TextDocumentView(origin=entities.DIAGNOSIS, name="Diagnosis")
    words = rrb.Vertical(
        rrb.Tabs(diagnosis, runs) if diagnosed else runs,
        rrb.Tabs(
            rrb.TextLogView(
                origin="log", name="Log", columns=rrb.TextLogColumns(text_log_columns=["loglevel", "body"])
            ),
            _curves("health", "Health", window, legend=True),
        ),
    )
    pictures = rrb.Vertical(rrb.Horizontal(*upper), lower, row_shares=[5, 6])
    panel = rrb.TimePanel(timeline=ELAPSED, state="collapsed", play_state="following" if live else "playing")
    return rrb.Blueprint(
        rrb.Horizontal(pictures, words, column_shares=[7, 3]),
        panel,
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )


def _camera(setup: Setup) -> rrb.View:
    width, height = setup.image_px
    return rrb.Spatial2DView(
        origin=entities.CAMERA,
        name="Camera: corners and reference",
        visual_bounds=rrb.VisualBounds2D(x_range=(0.0, width), y_range=(0.0, height)),
    )


def _linked() -> rrb.TimeAxis:
    return rrb.TimeAxis(link="LinkToGlobal")


def _window() -> list[rr.VisibleTimeRange]:
    start = rr.TimeRangeBoundary.cursor_relative(seconds=-_LIVE_WINDOW_S)
    return [rr.VisibleTimeRange(ELAPSED, start=start, end=rr.TimeRangeBoundary.cursor_relative())]


def _tilt(topics: Collection[str], window: list[rr.VisibleTimeRange] | None, *, corners_below: bool) -> rrb.View:
    """Returns the tilt; further sensors of the angle have names and colours that only a legend can tell.

    Its heading has the room for what the narrow ones of the corners below it cannot say.
    """
    sensors = any(topic.startswith(ANGLE_PREFIX) for topic in topics)
    return _curves("plots/tilt", f"{_TILT}; below: {_CORNERS}" if corners_below else _TILT, window, legend=sensors)


def _curves(origin: str, name: str, window: list[rr.VisibleTimeRange] | None, *, legend: bool = False) -> rrb.View:
    return rrb.TimeSeriesView(
        origin=origin,
        name=name,
        time_ranges=window,
        axis_x=_linked(),
        plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop, visible=legend),
    )


def _displacement(window: list[rr.VisibleTimeRange] | None, *, name: str | None = None) -> rrb.Container:
    """Returns the corners' displacements side by side.

    A block that does not turn moves them alike, on top of each other.
    """
    panels = (_corner(number, path, window) for number, path in enumerate(entities.DISPLACEMENT))
    return rrb.Horizontal(*panels, name=name)


def _corner(number: int, path: str, window: list[rr.VisibleTimeRange] | None) -> rrb.View:
    """Returns one corner's displacement; above the slip threshold nothing more is decided, so the axis ends there."""
    return rrb.TimeSeriesView(
        origin="plots/displacement",
        contents=[f"/{path}", f"/{entities.THRESHOLD}"],
        name=f"Corner {number} (px)",
        time_ranges=window,
        axis_x=_linked(),
        axis_y=rrb.ScalarAxis(range=_DISPLACEMENT_RANGE_PX, zoom_lock=True),
        plot_legend=rrb.PlotLegend(visible=False),
    )


def _scene(setup: Setup, *, arm: bool) -> rrb.View:
    """Returns the scene, seen from beyond the plate, so that the arm stands behind it and hides nothing."""
    reach = 3.3 * setup.plate_side_m if arm else min(2.0 * setup.plate_side_m, 16.0 * max(setup.block_size_m))
    x, y, z = setup.look_at_m
    away = math.atan2(y, x) + math.radians(_ASIDE_DEG)
    eye = (x + 0.8 * reach * math.cos(away), y + 0.8 * reach * math.sin(away), z + 0.6 * reach)
    return rrb.Spatial3DView(
        origin=entities.WORLD,
        name="Arm, plate and block" if arm else "Plate and block",
        line_grid=rrb.LineGrid3D(visible=arm, color=(60, 60, 70, 120)),  # the floor; a plate alone would lie in it
        eye_controls=rrb.EyeControls3D(position=eye, look_target=(x, y, z), eye_up=(0.0, 0.0, 1.0)),
    )
