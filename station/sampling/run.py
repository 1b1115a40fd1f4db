"""One run in progress: what was asked, what was seen, and the Sample that results from it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from shared.messages import DISTURBED, Environment, MotionReport, Sample
from station.rig.opening import Opening
from station.sampling.direction import Direction
from station.sampling.reference import Reference
from station.signals.mark_side import IMPOSSIBLE

FOAM = "foam"
"""The disturbance of a run in which the foam held the block, or stopped it before the slip rule could see it slide."""
SCALE = "scale"
"""The disturbance of a run in which the mark's side contradicts the plate's scale by more than printing explains."""

_FITTED_NS = 3_000_000_000
"""The stretch of path before the detection that is fitted: it has a second and more of rest at any tilt rate."""


@dataclass(frozen=True, kw_only=True)
class Specimen:
    """The block and plate on the rig, with the opening in the plate's foam, as the rig file describes them."""

    object: str = ""
    plate: str = ""
    plate_mount_rad: float = 0.0
    block_mass_kg: float = 0.0
    block_area_m2: float = 0.0
    opening: Opening = field(default_factory=Opening)


@dataclass(slots=True)
class Run:
    """The state of one run, which is filled in as it goes."""

    number: int
    start_ns: int
    dwell_wanted_s: float
    direction: Direction = field(default_factory=lambda: Direction(0, 0.0))
    rate_deg_s: float = 5.0
    reference: Reference | None = None
    way_px: float = math.inf
    """The way, px, that the foam lets the block slide: none where it holds the block."""
    off_scale: float = 0.0
    """The share by which the mark's own side contradicts the plate's scale."""
    angles_rad: tuple[float, ...] = ()
    step: int = 0
    rest_ns: int = 0
    tilt_ns: int = 0
    detect_ns: int = 0
    slip_ns: int = 0
    onset_rad: float = 0.0
    onset_sigma_rad: float = 0.0
    euler_rad: tuple[float, ...] = ()
    censored: bool = False
    flags: list[str] = field(default_factory=list[str])
    steps: list[tuple[int, float]] = field(default_factory=list[tuple[int, float]])
    """Begin (ns) and target (rad) of every tilt step executed."""

    def disturb(self, what: str) -> None:
        """Marks the run as disturbed by something other than friction: its sample counts nowhere."""
        flag = f"{DISTURBED}_{what}"
        if flag not in self.flags:
            self.flags.append(flag)

    def meet_foam(self, *, needed_px: float) -> None:
        """Marks the run if the foam stops the block before it has slid so far: the foam's hold is no friction."""
        if self.way_px < needed_px:
            self.disturb(FOAM)

    @property
    def fitted_from_ns(self) -> int:
        """The begin of the stretch before the detection that the onset is fitted to, ns."""
        return max(self.tilt_ns, self.detect_ns - _FITTED_NS)

    def measure_scale(self, off_scale: float) -> None:
        """Takes the share by which the mark's side contradicts the plate's scale; marks a run in which it cannot."""
        self.off_scale = off_scale
        if not off_scale <= IMPOSSIBLE:
            self.disturb(SCALE)

    @property
    def lasting(self) -> str:
        """Says by what the run was disturbed that disturbs the next one, too, and what to do; empty if by nothing."""
        if f"{DISTURBED}_{FOAM}" in self.flags:
            return "the foam held the block, and no direction of the plan leads it away: lay it on the plate's middle"
        if f"{DISTURBED}_{SCALE}" in self.flags:
            return (
                f"the mark's side was {self.off_scale:.0%} off on the plate's map: measure [mark] side_mm, and "
                "calibrate the camera again"
            )
        return ""

    @property
    def disturbed(self) -> bool:
        """True if the run is marked as disturbed."""
        return any(flag.startswith(DISTURBED) for flag in self.flags)

    def began(self, motion: MotionReport) -> None:
        """Notes that a step's motion has begun."""
        self.steps.append((motion.begin_ns, self.angles_rad[motion.step - 1]))

    def bracket_rad(self, at_ns: int) -> tuple[float, float]:
        """Returns the tilt step in which a moment fell: where it started and where it was to end."""
        before, target = 0.0, self.steps[0][1] if self.steps else 0.0
        for begin_ns, angle in self.steps:
            if begin_ns > at_ns:
                break
            before, target = (target, angle) if angle != target else (before, target)
        return before, target

    def sample(
        self,
        *,
        post_corners_px: tuple[float, ...],
        previous: int,
        specimen: Specimen,
        start: tuple[float, float, float],
        rate_rad_s: float,
        environment: Environment | None,
    ) -> Sample:
        """Returns the run as a Sample: Table II and more.

        `start` is the block's place before it: x, y (m) and yaw (rad).
        """
        reference = self.reference or Reference((), ())
        x, y, yaw = start
        low, high = self.bracket_rad(self.slip_ns or self.detect_ns)
        return Sample(
            run=self.number,
            start_ns=self.start_ns,
            slip_ns=self.slip_ns,
            detect_ns=self.detect_ns,
            euler_rad=self.euler_rad,
            reference_corners_px=reference.corners_px,
            corner_variance_px2=reference.variance_px2,
            post_corners_px=post_corners_px,
            direction=self.direction.number,
            azimuth_rad=self.direction.azimuth_rad,
            dwell_s=(self.tilt_ns - self.rest_ns) * 1e-9,
            tilt_rate_rad_s=rate_rad_s,
            onset_angle_rad=self.onset_rad,
            onset_sigma_rad=self.onset_sigma_rad,
            flags=tuple(self.flags),
            plate_mount_rad=specimen.plate_mount_rad,
            block_mass_kg=specimen.block_mass_kg,
            block_area_m2=specimen.block_area_m2,
            object=specimen.object,
            plate=specimen.plate,
            temperature_c=environment.temperature_c if environment else math.nan,
            relative_humidity=environment.relative_humidity if environment else math.nan,
            censored=self.censored,
            previous_direction=previous,
            rest_ns=self.rest_ns,
            step_from_rad=low,
            step_to_rad=high,
            start_x_m=x,
            start_y_m=y,
            start_yaw_rad=yaw,
        )
