"""Every measurement that crosses a process boundary, as frozen dataclasses.

The bus payload, the schema in a recording and the view are derived from these classes (see `shared.wire`). The order
of the fields is their protobuf number, so this file is append-only: a field is added at the end of its class, never
renamed, moved or given another meaning. Times are nanoseconds; units stand in the names. `repose.` is their package.

Every field has a default, because protobuf gives one to whatever a sender left out.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from itertools import chain
from typing import ClassVar

from shared.frozen import quicken
from shared.possible import FARTHEST_M, counted, invertible, measurable, measurable_if_known, sized, some, turned

Floats = tuple[float, ...]
Ints = tuple[int, ...]
Strings = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Message:
    """Base of all messages; `PACKAGE` is the protobuf package that the class belongs to."""

    PACKAGE: ClassVar[str] = "repose"

    def __init_subclass__(cls) -> None:
        """Quickens the class's `__init__`; a class passes here as it is written, and again with its slots."""
        if "__slots__" in cls.__dict__ and fields(cls):
            quicken(cls)

    def impossible(self) -> str:
        """Names, in words that follow "got", what no message of this class can hold; empty if there is nothing.

        A payload that parses can still hold four of eight coordinates, or an attitude that is none.
        """
        return ""


REPEATED = "the frame is the one before it again"
"""The `reason` of corners that were not sought, because the camera is frozen."""


@dataclass(frozen=True, slots=True)
class MarkerCorners(Message):
    """The corners of one marker in one frame: the measurement itself.

    `corners_px` is x0 y0 x1 y1 x2 y2 x3 y3, in a fixed order by identity, in OpenCV's pixel coordinates (the centre of
    the top-left pixel is (0, 0), x right, y down). `sigma_px` is one corner's standard deviation in x and in y.
    `corner_dt_ns` is each corner's own mid-exposure relative to `capture_ns`.
    """

    capture_ns: int = 0
    seq: int = 0
    corners_px: Floats = ()
    sigma_px: float = 0.0
    residual_px: float = 0.0
    exposure_ns: int = 0
    corner_dt_ns: Ints = ()
    found: bool = False
    reason: str = ""
    marker_id: int = 0
    boot_id: int = 0
    """An identifier of one life of the agent: `seq` starts anew with it."""
    tipped: bool = False
    """The mark looks foreshortened: the block is tipping over, which is not sliding."""
    noiseless: bool = False
    """The camera is a simulation without noise: the same corners again are no sign that it is frozen."""

    def impossible(self) -> str:
        """Names a wrong count of coordinates or times, or corners of a mark that was found that cannot be measured."""
        corners = (*self.corners_px, self.sigma_px) if self.found else ()
        if wrong := measurable("corners_px and sigma_px of a mark that was found", corners):
            return wrong
        counts = (8,) if self.found else (0, 8)
        return counted("corners_px", self.corners_px, *counts) or counted("corner_dt_ns", self.corner_dt_ns, 0, 4)


@dataclass(frozen=True, slots=True)
class BlockPose(Message):
    """Pose of the block in the plate frame (plate_from_block), for blocks followed by another tracker."""

    stamp_ns: int = 0
    seq: int = 0
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    qw: float = 1.0
    qx: float = 0.0
    qy: float = 0.0
    qz: float = 0.0
    sigma_m: float = 0.0
    sigma_rad: float = 0.0
    found: bool = False
    reason: str = ""

    def impossible(self) -> str:
        """Names the pose of a block that was found, if it is none."""
        place = (self.x, self.y, self.z, self.sigma_m, self.sigma_rad)
        wrong = turned(self.qw, self.qx, self.qy, self.qz) or measurable("its place and its sigmas", place)
        return wrong if self.found else ""


@dataclass(frozen=True, slots=True)
class PlatformState(Message):
    """Attitude of the plate (world_from_plate; world z is up), its rate in the plate frame, and the pivot."""

    stamp_ns: int = 0
    qw: float = 1.0
    qx: float = 0.0
    qy: float = 0.0
    qz: float = 0.0
    wx: float = 0.0
    wy: float = 0.0
    wz: float = 0.0
    px: float = 0.0
    py: float = 0.0
    pz: float = 0.0
    frame_id: str = ""

    def impossible(self) -> str:
        """Names the quaternion, if it is no rotation, or a rate or a pivot that cannot be measured."""
        return (
            turned(self.qw, self.qx, self.qy, self.qz)
            or measurable("its rate", (self.wx, self.wy, self.wz))
            or measurable("its pivot", (self.px, self.py, self.pz), most=FARTHEST_M)
        )


@dataclass(frozen=True, slots=True)
class JointState(Message):
    """The measured state of the arm's joints."""

    stamp_ns: int = 0
    name: Strings = ()
    position_rad: Floats = ()
    velocity_rad_s: Floats = ()
    effort_nm: Floats = ()

    def impossible(self) -> str:
        """Names positions that are missing, lists that are not as long as the joints, or what cannot be measured.

        Many arms know no efforts, and say nan.
        """
        joints = len(self.name) or len(self.position_rad)
        return (
            some("position_rad", self.position_rad)
            or measurable("position_rad", self.position_rad)
            or measurable_if_known("velocity_rad_s and effort_nm", (*self.velocity_rad_s, *self.effort_nm))
            or counted("position_rad", self.position_rad, joints)
            or counted("velocity_rad_s", self.velocity_rad_s, 0, joints)
            or counted("effort_nm", self.effort_nm, 0, joints)
        )


@dataclass(frozen=True, slots=True)
class TiltCommand(Message):
    """A command to the arm: tilt to `angle_rad` about the axis at `azimuth_rad` (the paper's β)."""

    stamp_ns: int = 0
    run: int = 0
    direction: int = 0
    azimuth_rad: float = 0.0
    angle_rad: float = 0.0
    step: int = 0
    rate_rad_s: float = 0.0
    owner: str = ""
    """The session that asks; the arm obeys the one that has it."""

    def impossible(self) -> str:
        """Names an angle or a rate that cannot be measured."""
        return measurable("azimuth_rad, angle_rad and rate_rad_s", (self.azimuth_rad, self.angle_rad, self.rate_rad_s))


@dataclass(frozen=True, slots=True)
class RunEvent(Message):
    """A phase of a run began: one of `PHASES`."""

    stamp_ns: int = 0
    run: int = 0
    phase: str = ""
    reason: str = ""
    step: int = 0
    """The tilt step that STEP_BEGIN and STEP_END speak of; zero otherwise."""


PHASES = (
    *("LEVEL", "DWELL", "REFERENCE", "TILT", "SLIP", "SETTLE", "RETURN", "DONE", "ABORTED"),
    *("STEP_BEGIN", "STEP_END", "SYNC"),
)


DISTURBED = "disturbed"
"""The begin of the flags of a sample that something other than friction has disturbed: it counts nowhere."""


@dataclass(frozen=True, slots=True)
class Sample(Message):
    """One run's result: the paper's Table II and what is needed beyond it."""

    run: int = 0
    start_ns: int = 0
    slip_ns: int = 0
    detect_ns: int = 0
    euler_rad: Floats = ()
    reference_corners_px: Floats = ()
    corner_variance_px2: Floats = ()
    post_corners_px: Floats = ()
    direction: int = 0
    azimuth_rad: float = 0.0
    dwell_s: float = 0.0
    tilt_rate_rad_s: float = 0.0
    onset_angle_rad: float = 0.0
    onset_sigma_rad: float = 0.0
    flags: Strings = ()
    plate_mount_rad: float = 0.0
    block_mass_kg: float = 0.0
    block_area_m2: float = 0.0
    object: str = ""
    plate: str = ""
    temperature_c: float = 0.0
    relative_humidity: float = 0.0
    censored: bool = False
    previous_direction: int = -1
    rest_ns: int = 0
    step_from_rad: float = 0.0
    step_to_rad: float = 0.0
    start_x_m: float = 0.0
    start_y_m: float = 0.0
    start_yaw_rad: float = 0.0

    @property
    def disturbed(self) -> bool:
        """True if something other than friction, such as a cut link or late frames, has disturbed the run."""
        return any(flag.startswith(DISTURBED) for flag in self.flags)

    def impossible(self) -> str:
        """Names a negative run, a list of a wrong length, or a number beyond all rigs."""
        if self.run < 0:
            return f"{self.run} as run, of which none is negative"
        lists = {
            "reference_corners_px": self.reference_corners_px,
            "corner_variance_px2": self.corner_variance_px2,
            "post_corners_px": self.post_corners_px,
        }
        wrong = [counted(name, values, 0, 8) for name, values in lists.items()]
        numbers = measurable_if_known("its numbers", (*self.euler_rad, *chain(*lists.values()), *self._numbers()))
        block = [sized("block_mass_kg", self.block_mass_kg), sized("block_area_m2", self.block_area_m2)]
        return next(filter(None, [counted("euler_rad", self.euler_rad, 0, 3), *wrong, numbers, *block]), "")

    def _numbers(self) -> Floats:
        tilt = (self.azimuth_rad, self.tilt_rate_rad_s, self.onset_angle_rad, self.onset_sigma_rad)
        steps = (self.dwell_s, self.step_from_rad, self.step_to_rad)
        start = (self.start_x_m, self.start_y_m, self.start_yaw_rad)
        return (*tilt, *steps, self.plate_mount_rad, *start, self.temperature_c, self.relative_humidity)


@dataclass(frozen=True, slots=True)
class AngleReading(Message):
    """One reading of another angle sensor; the gravity unit vector is in the plate frame (zeros: unknown)."""

    stamp_ns: int = 0
    source: str = ""
    angle_rad: float = 0.0
    gravity_x: float = 0.0
    gravity_y: float = 0.0
    gravity_z: float = 0.0
    sigma_rad: float = 0.0

    def impossible(self) -> str:
        """Names an angle, a sigma or a direction of gravity that cannot be measured."""
        gravity = (self.gravity_x, self.gravity_y, self.gravity_z)
        return measurable("its angle, its sigma and gravity", (self.angle_rad, self.sigma_rad, *gravity))


@dataclass(frozen=True, slots=True)
class Environment(Message):
    """The air around the rig."""

    stamp_ns: int = 0
    temperature_c: float = 0.0
    relative_humidity: float = 0.0

    def impossible(self) -> str:
        """Names a temperature or a humidity that is beyond all rigs; nan is one that nobody measures."""
        return measurable_if_known("the air", (self.temperature_c, self.relative_humidity))


@dataclass(frozen=True, slots=True)
class ClockOffset(Message):
    """Station clock minus agent clock, measured by round trips."""

    stamp_ns: int = 0
    agent: str = ""
    offset_ns: int = 0
    sigma_ns: int = 0
    rtt_ns: int = 0


@dataclass(frozen=True, slots=True)
class AgentStatus(Message):
    """The state of the camera agent; `fault` is one clear sentence, or empty."""

    stamp_ns: int = 0
    frames: int = 0
    dropped: int = 0
    queue: int = 0
    exposure_ns: int = 0
    gain: float = 0.0
    temperature_c: float = 0.0
    cpu_percent: float = 0.0
    version: str = ""
    fault: str = ""
    rate_hz: float = 0.0
    boot_id: int = 0

    def impossible(self) -> str:
        """Names a gain, a temperature, a load or a rate that is beyond all rigs; nan is one that nobody measures."""
        numbers = (self.gain, self.temperature_c, self.cpu_percent, self.rate_hz)
        return measurable_if_known("its gain, temperature, load and rate", numbers)


@dataclass(frozen=True, slots=True)
class ArmReply(Message):
    """The arm agent's answer to a command; `reason` says why it was refused. `run` and `step` are the command's."""

    accepted: bool = False
    reason: str = ""
    stamp_ns: int = 0
    run: int = 0
    step: int = 0
    passing: bool = False
    """True if the network is the cause: the same command may be accepted once the connection is back."""


@dataclass(frozen=True, slots=True)
class ArmStop(Message):
    """Stops the arm where it is, now."""

    stamp_ns: int = 0
    reason: str = ""


REPLACED = "replaced by the next command"


@dataclass(frozen=True, slots=True)
class MotionReport(Message):
    """One commanded motion as it was executed: `begin_ns` when it began, `end_ns` zero until it has ended.

    `run` and `step` are the command's; `fault` is empty or says why the motion was stopped (`REPLACED`: by the next
    command, which is no fault).
    """

    stamp_ns: int = 0
    run: int = 0
    step: int = 0
    begin_ns: int = 0
    end_ns: int = 0
    fault: str = ""
    passing: bool = False
    """True if the network caused the fault: the same motion may succeed once the connection is back."""


@dataclass(frozen=True, slots=True)
class Heartbeat(Message):
    """The station is alive and wants the arm to go on obeying (`armed`)."""

    stamp_ns: int = 0
    armed: bool = False
    owner: str = ""
    """The session that beats; the first one has the arm for as long as it does."""


@dataclass(frozen=True, slots=True)
class ClockPing(Message):
    """Asks an agent for its clock."""

    station_ns: int = 0


@dataclass(frozen=True, slots=True)
class ClockPong(Message):
    """The agent's clock when it answered."""

    station_ns: int = 0
    agent_ns: int = 0


@dataclass(frozen=True, slots=True)
class FrameRequest(Message):
    """Asks the camera agent for every full frame of the coming (or the last, if buffered) stretch of time."""

    from_ns: int = 0
    to_ns: int = 0


@dataclass(frozen=True, slots=True)
class FrameReply(Message):
    """The number of frames that the agent will send; `reason` says why none."""

    frames: int = 0
    reason: str = ""


@dataclass(frozen=True, slots=True)
class JointTarget(Message):
    """Joint set-points for the twin."""

    stamp_ns: int = 0
    position_rad: Floats = ()
    velocity_rad_s: Floats = ()

    def impossible(self) -> str:
        """Names positions that are missing, velocities that are not as many, or what cannot be measured."""
        return (
            some("position_rad", self.position_rad)
            or counted("velocity_rad_s", self.velocity_rad_s, len(self.position_rad))
            or measurable("a set-point", (*self.position_rad, *self.velocity_rad_s))
        )


@dataclass(frozen=True, slots=True)
class TwinScene(Message):
    """The twin's truth: world_from_plate attitude and pivot, plate_from_block pose, and the friction drawn.

    Only the synthetic camera may read it; measuring, analysing and diagnosing code may not.
    """

    stamp_ns: int = 0
    qw: float = 1.0
    qx: float = 0.0
    qy: float = 0.0
    qz: float = 0.0
    px: float = 0.0
    py: float = 0.0
    pz: float = 0.0
    block_x_m: float = 0.0
    block_y_m: float = 0.0
    block_z_m: float = 0.0
    block_qw: float = 1.0
    block_qx: float = 0.0
    block_qy: float = 0.0
    block_qz: float = 0.0
    mu: float = 0.0

    def impossible(self) -> str:
        """Names the quaternion of the plate or of the block, if it is no rotation, or a number beyond all rigs."""
        block = (self.block_qw, self.block_qx, self.block_qy, self.block_qz)
        place = (self.px, self.py, self.pz, self.block_x_m, self.block_y_m, self.block_z_m)
        wrong = turned(self.qw, self.qx, self.qy, self.qz) or turned(*block)
        return wrong or measurable("the places and the friction", (*place, self.mu))


@dataclass(frozen=True, slots=True)
class CameraGeometry(Message):
    """The calibration that turns pixels into places on the plate, beyond what foxglove.CameraCalibration holds.

    `plate_from_pixel` is the homography (9 numbers, row by row) from undistorted pixels to metres in the plate's
    plane. The mark lies `mark_height_m` above that plane and the camera's pinhole `camera_height_m`, both of which
    the parallax needs. `corner_sigma_px` is the noise found in calibration (the paper's estimated variance).
    """

    stamp_ns: int = 0
    plate_from_pixel: Floats = ()
    mm_per_px: float = 0.0
    marker_side_m: float = 0.0
    marker_aspect: float = 1.0
    mark_height_m: float = 0.0
    camera_x_m: float = 0.0
    camera_y_m: float = 0.0
    camera_height_m: float = 0.0
    corner_sigma_px: float = 0.0
    source: str = ""

    def if_calibrated(self) -> CameraGeometry | None:
        """Returns itself if it says where pixels are on the plate.

        It is None for one without a homography, as at its defaults.
        """
        return self if self.plate_from_pixel else None

    def impossible(self) -> str:
        """Names a homography that maps no plane to a plane, a number beyond all rigs, or a mark above the camera."""
        homography, height_m = self.plate_from_pixel, self.camera_height_m
        wrong = counted("plate_from_pixel", homography, 0, 9) or measurable("its numbers", self._numbers())
        if not wrong and self.mark_height_m and not 0.0 < self.mark_height_m < height_m:
            wrong = f"a camera_height_m of {height_m} over a mark_height_m of {self.mark_height_m}"
        return wrong or (invertible("plate_from_pixel", homography) if homography else "")

    def _numbers(self) -> Floats:
        place = (self.camera_x_m, self.camera_y_m, self.camera_height_m)
        mark = (self.marker_side_m, self.marker_aspect, self.mark_height_m)
        return (*place, *mark, self.mm_per_px, self.corner_sigma_px)


@dataclass(frozen=True, slots=True)
class LeaseRequest(Message):
    """A session asks for the arm; with `take_over` also if another one has it."""

    stamp_ns: int = 0
    owner: str = ""
    take_over: bool = False


@dataclass(frozen=True, slots=True)
class ArmLease(Message):
    """The session that has the arm, and the reason of the emergency stop in force: empty while none is."""

    stamp_ns: int = 0
    owner: str = ""
    stopped: str = ""


@dataclass(frozen=True, slots=True)
class SessionPause(Message):
    """While `paused`, a session begins no further run; the run under way comes to its end, and the plate is level."""

    stamp_ns: int = 0
    paused: bool = False


@dataclass(frozen=True, slots=True)
class SessionStatus(Message):
    """The progress of a session, for whoever looks on.

    A corner counts as moved beyond `slip_base_px` + `slip_per_deg_px` × tilt in degrees; `slip_corners` of them are a
    slip. `recording` is the name of the file.
    """

    stamp_ns: int = 0
    owner: str = ""
    recording: str = ""
    samples: int = 0
    total: int = 0
    paused: bool = False
    slip_base_px: float = 0.0
    slip_per_deg_px: float = 0.0
    slip_corners: int = 0
    started_ns: int = 0

    def impossible(self) -> str:
        """Names limits of a slip that cannot be measured, and a number of samples that no plan has."""
        return measurable("slip_base_px and slip_per_deg_px", (self.slip_base_px, self.slip_per_deg_px)) or measurable(
            "total", (self.total,)
        )


SESSION_ACTIONS = ("pause", "resume", "stop")


@dataclass(frozen=True, slots=True)
class SessionRequest(Message):
    """Asks the session for one of `SESSION_ACTIONS`; `stop` brings the plate back to level and ends the session."""

    stamp_ns: int = 0
    action: str = ""


@dataclass(frozen=True, slots=True)
class SessionReply(Message):
    """The session's answer; `reason` says in a sentence why a request was refused."""

    accepted: bool = False
    reason: str = ""
