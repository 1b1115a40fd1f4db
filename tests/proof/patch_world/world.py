"""All numbers of one world: block, bristles, plate, arm, sensors and camera. SI units and radians.

The default world is the plain one: an even sole with one coefficient of friction and a fifth of a micrometre of give,
an arm that is where its encoders say, and a camera that is where it was calibrated. An effect changes these numbers.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple


class Contact(NamedTuple):
    """The numbers that the integrator reads at each step; all floats, so that numba takes them as they are."""

    mass: float = 0.015
    half_x: float = 0.008
    half_y: float = 0.008
    height: float = 0.008
    mu: float = 0.36
    # Bristles: stiffness over normal load (1/m), damping (s/m), share of the strength up to which they are elastic.
    stiffness: float = 2e6
    damping: float = 270.0
    elastic_share: float = 0.7
    # Speed: a fall by `weak_drop` with exponent (Bo and Pavelka), a rise of `direct` per asinh(v / 2 v0), an oil film.
    weak_drop: float = 0.0
    weak_speed: float = 0.01
    weak_exponent: float = 1.0
    direct: float = 0.0
    direct_speed: float = 1e-3
    film: float = 0.0
    # Slip weakening over a length, and healing by the logarithm of the age of the contacts (Dieterich).
    slip_drop: float = 0.0
    slip_length: float = 5e-5
    age_gain: float = 0.0
    age_time: float = 0.3
    age_length: float = 2e-5
    # Elliptic limit curves and one-way naps, fixed in the plate or in the sole (axes in radians).
    plate_ratio: float = 0.0
    plate_axis: float = 0.0
    sole_ratio: float = 0.0
    sole_axis: float = 0.0
    plate_nap: float = 0.0
    plate_nap_axis: float = 0.0
    sole_nap: float = 0.0
    sole_nap_axis: float = 0.0
    # Forces that are no friction: a magnet under the plate, a thread, gusts of air, an inner mass on a spring.
    magnet_n: float = 0.0
    magnet_x: float = 0.0
    magnet_y: float = 0.0
    magnet_reach: float = 0.012
    thread_n_m: float = 0.0
    thread_x: float = 0.0
    thread_y: float = 0.0
    gust_n: float = 0.0
    gust_axis: float = 0.0
    gust_period: float = 40.0
    gust_share: float = 0.4
    slosh_share: float = 0.0
    slosh_omega: float = 30.0
    slosh_damping: float = 0.1
    # Strength that is lost under a load near to it (delayed rupture), per second at full load.
    fatigue: float = 0.0
    # The foam: a round opening whose edge yields.
    wall_radius: float = 0.045
    wall_stiffness: float = 80.0
    wall_damping: float = 1.5
    wall_return: float = 0.25
    # The plate: its true lean when it is called level, and where it truly turns (from the stated pivot).
    lean_x: float = 0.0
    lean_y: float = 0.0
    pivot_x: float = 0.0
    pivot_y: float = 0.0
    pivot_z: float = 0.0
    pivot_height: float = 0.004
    # The arm: ringing of the wrist, play of the gears (half), and the filters of its sensors (s).
    ring_hz: float = 14.0
    ring_damping: float = 0.35
    play: float = 0.0
    angle_filter: float = 0.0
    rate_filter: float = 0.0
    gravity: float = 9.81


@dataclass(frozen=True, kw_only=True)
class Patch:
    """The differences over plate and sole. `spots` are (x, y, radius, relative change) on the plate, m.

    `field_sd` and `field_length_m` are the plate's own random field, drawn with `field_seed` once a session.
    `lopsided` is the relative change of friction from the sole's middle to its edge along (x, y) of the block.
    """

    spots: tuple[tuple[float, float, float, float], ...] = ()
    field_sd: float = 0.0
    field_length_m: float = 0.015
    field_seed: int = 0
    lopsided: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class History:
    """The relative changes of friction from run to run.

    `polish` is lost with the constant `polish_runs`; `cycle` is the amplitude of a sine of the session's time;
    `memory` is the change for a run along the last one's way (the opposite against it); a share `dust_share` of
    runs has a grain under one corner, which takes `dust_drop`.
    """

    polish: float = 0.0
    polish_runs: float = 30.0
    cycle: float = 0.0
    cycle_s: float = 400.0
    cycle_phase: float = 0.0
    memory: float = 0.0
    dust_share: float = 0.0
    dust_drop: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Scatter:
    """The draws of each run: friction as a whole, its wander over the places of the run, and the sole.

    `pressure_sd` and `sole_sd` are the relative spread of the points' share of the load and of their friction.
    """

    run_sd: float = 0.02
    wander_sd: float = 0.0
    wander_length_m: float = 0.003
    pressure_sd: float = 0.0
    sole_sd: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Sensing:
    """The arm's reports of its attitude: gain and offset of the angle, noise, step of the encoder, and stamps.

    `stamp_s` is by how much a stamp lies before the moment at which the attitude was so. `askew_rad` is the rotation
    vector of the inclinometer on the plate.
    """

    gain: float = 1.0
    offset_rad: float = 0.0
    noise_rad: float = 5e-5
    step_rad: float = 0.0
    rate_noise_rad_s: float = 5e-4
    stamp_s: float = 0.0
    askew_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class Camera:
    """The camera's errors. `bend_px` is its shift at a vertical plate, `bend_along` the share that follows the slope.

    `radial` is the coefficient of r² (r in focal lengths). `readout_s` passes from the first row to the last.
    From run `slip_run` on the whole picture is shifted by (`slip_x_px`, `slip_y_px`).
    `pixel_sd` is one corner's noise, `pose_sd_px` what all four share; `outlier_share` of frames have one wrong corner,
    `unseen_share` show no mark, `skipped_share` never come.
    """

    bend_px: float = 0.0
    bend_along: bool = True
    bend_axis: float = 0.0
    radial: float = 0.0
    readout_s: float = 0.0
    slip_run: int = 10**9
    slip_x_px: float = 0.0
    slip_y_px: float = 0.0
    pixel_sd: float = 0.04
    pose_sd_px: float = 0.01
    outlier_share: float = 0.0
    outlier_px: float = 4.0
    unseen_share: float = 0.0
    skipped_share: float = 0.0


@dataclass(frozen=True, kw_only=True)
class World:
    """One world. `tones` are the arm's shaking: (Hz, m/s² along x, along y, phase) each."""

    contact: Contact = field(default_factory=Contact)
    patch: Patch = field(default_factory=Patch)
    history: History = field(default_factory=History)
    scatter: Scatter = field(default_factory=Scatter)
    sensing: Sensing = field(default_factory=Sensing)
    camera: Camera = field(default_factory=Camera)
    tones: tuple[tuple[float, float, float, float], ...] = ()
