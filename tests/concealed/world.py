"""A world is every hidden parameter at its null value, and what one run brings of its own.

Both are named tuples of plain floats, so that the compiled kernel takes them as they are.
"""

from __future__ import annotations

import math
from typing import NamedTuple

GRAVITY = 9.81
TURNING_ARM = math.sqrt(1.0 / 12.0)
"""The root mean square distance of a unit square's points from its middle, along any line."""
BASE_HZ = 900
"""Substeps a second: every 10th is a frame (90 Hz), every 9th an attitude (100 Hz), every 45th another sensor's reading
(20 Hz), every 60th a view of the fiducial (15 Hz)."""
DT_S = 1.0 / BASE_HZ
FRAME, ATTITUDE, SENSOR, FIDUCIAL = 10, 9, 45, 60


class World(NamedTuple):
    """A rig with its two surfaces; at the values given here it is a rigid block on a Coulomb plate, seen perfectly.

    Lengths are metres, times seconds, angles radians, image shifts pixels; shares are of the friction coefficient.
    Shapes choose between two parametrisations of one effect (README.md gives their sources).
    """

    mu: float = 0.36
    # --- contact ---
    drop: float = 0.0
    fall: float = 0.0
    fall_speed: float = 0.02
    fall_shape: float = 0.0
    rate_gain: float = 0.0
    rate_speed: float = 0.002
    drag_per_s: float = 0.0
    ageing: float = 0.0
    ageing_cutoff_s: float = 0.1
    ageing_shape: float = 0.0
    wear: float = 0.0
    wear_runs: float = 40.0
    wear_shape: float = 0.0
    grain_object: float = 0.0
    grain_object_axis: float = 0.0
    grain_object_shape: float = 0.0
    grain_plate: float = 0.0
    grain_plate_axis: float = 0.0
    grain_plate_shape: float = 0.0
    nap_object: float = 0.0
    nap_object_axis: float = 0.0
    nap_plate: float = 0.0
    nap_plate_axis: float = 0.0
    patch: float = 0.0
    patch_x: float = 0.0
    patch_y: float = 0.0
    patch_radius: float = 0.012
    patch_shape: float = 0.0
    adhesion_n: float = 0.0
    load_power: float = 0.0
    load_reference_n: float = 0.077
    presliding_m: float = 0.0
    presliding_shape: float = 0.0
    uneven_x: float = 0.0
    uneven_y: float = 0.0
    """Friction's resultant acts here, in the block's frame from the point under its mass, metres."""
    foam_per_s2: float = 0.0
    foam_damping_s: float = 0.005
    foam_width: float = 0.006
    tips_at: float = math.inf
    """Tilt at which it tips straight over an edge, its mass being over the middle of its sole."""
    mass_x: float = 0.0
    mass_y: float = 0.0
    """The block's mass is here over the sole, in its frame, metres: it moves the tilt at which the block tips."""
    # --- rig ---
    level_x: float = 0.0
    level_y: float = 0.0
    scale: float = 0.0
    offset: float = 0.0
    play: float = 0.0
    pivot_height: float = 0.0
    shake: float = 0.0
    shake_axis: float = 0.0
    shake_hz: float = 11.0
    # --- camera ---
    late_s: float = 0.0
    sag_px: float = 0.0
    lens: float = 0.0
    readout_s: float = 0.0
    # --- in no catalogue ---
    magnet: float = 0.0
    magnet_x: float = 0.0
    magnet_y: float = 0.0
    magnet_radius: float = 0.015
    damp: float = 0.0
    charge: float = 0.0
    charge_slides: float = 8.0
    echo_length: float = 0.0
    echo_direction: float = 0.0
    bend_per_m: float = 0.0
    tide: float = 0.0
    tide_s: float = 400.0
    tide_phase: float = 0.0
    lift: float = 0.0
    lift_speed: float = 0.1
    fourfold: float = 0.0
    fourfold_axis: float = 0.0
    # --- nature's own, no effect ---
    wander: float = 0.0
    """Standard deviation of ln friction along a path: an exponential covariance of the distance, anew in every run."""
    wander_length: float = 0.003
    # --- what the rig is known to be ---
    side: float = 0.01
    wall_radius: float = 0.0385
    px_per_m: float = 6000.0
    mark_side: float = 0.0075
    mark_height: float = 0.01
    camera_height: float = 0.3


NULL = World()


class RunFacts(NamedTuple):
    """The facts of one run: its draws, its load, its place in the session. Angles in the plate (image) frame."""

    number: float = 0.0
    draw: float = 1.0
    """This run's friction over the mean."""
    mass: float = 0.00785
    azimuth: float = 0.0
    """The azimuth of the tilting axis, the paper's β; the steepest line is (sin β, −cos β)."""
    mount: float = 0.0
    previous_azimuth: float = math.nan
    previous_length: float = 0.008
    slides_since_handled: float = 0.0
    humidity: float = 45.0
    shake_phase: float = 0.0
    knock_at_s: float = math.inf
    """The time of a knock after the tilt's beginning."""
    knock_speed: float = 0.0
    knock_azimuth: float = 0.0
    sigma_px: float = 0.1
    dropout: float = 0.0
    """Probability that a frame is lost."""


class Program(NamedTuple):
    """The machine's program of a run; times in substeps, angles and rates in radians."""

    dwell: int
    hidden: int
    """Substeps in which a hand covers the mark, at the beginning."""
    rate: float
    return_rate: float
    acceleration: float
    hold: int
    base_px: float
    per_deg_px: float
