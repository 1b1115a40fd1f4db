"""The twin's world: an arm that follows joint set-points, and a block that sticks to its plate until the right angle.

The arm, which feels nothing of a loose block, goes ahead by one step a look (10 ms), to half a look after the look's
end, and is read at the moment asked for. A loose block follows in its own steps (`stepping`), in which no time is
saved. Between looks the world decides what the block is: a part of the plate while it sticks below `LETS_GO`, held by
contact above, a new contact after a slide. What cannot happen is not computed, and `savings` says what that is:
- while the set-points are reached and the block sticks with a utilisation below `RESTING`, the state is an equilibrium
  and time is skipped;
- a part of the plate that is far from letting go is looked at less often, as is a block that the foam presses on;
- a loose block that lies still is asked less often whether it holds;
- the foam is looked at only when the block could reach it before the next look.
A test compares onsets with and without these.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from station.rig.arm_model import ArmModel
from station.simulators.mujoco import grip, model
from station.simulators.mujoco.contact import EXACT, Contact
from station.simulators.mujoco.engine import BlockEngine
from station.simulators.mujoco.engines import Engines
from station.simulators.mujoco.influence import Influence
from station.simulators.mujoco.poses import LEAN_RAD, Joints, PlatePose, Pose, plate_pose, standing
from station.simulators.mujoco.savings import EVERYTHING, SAVING, SPENT_M_S2
from station.simulators.mujoco.servo import Servo
from station.simulators.mujoco.specimen import Block, Friction, FrictionDraw, Plate
from station.simulators.mujoco.stepping import STEP_NS, STEP_S, Mechanism, settle, step

FLOATS = NDArray[np.float64]
LOOK = 5
LOOK_NS = LOOK * STEP_NS
LOOK_S = LOOK_NS * 1e-9
"""The block's time steps from one look at it to the next, and how long they take (10 ms): one step of the arm."""
AHEAD_NS = LOOK_NS // 2
"""The arm's places are known for so much later than the end of the look under way: see `grip.PlateMotion`."""
UNEVEN = 0.1
"""The share of their velocity by which the joints may answer differently to a sudden command."""
LETS_GO, GRIPS = 0.95, 0.93
"""Utilisation above which contact is simulated, and below which a resting block may become a part of the plate."""
LEANING = 0.95
"""The factor on LETS_GO and GRIPS for a block that leans on the foam, whose force is known less exactly. With 0.8
instead, 24 sessions of 40 runs on steel had as many falls (3, not 4) and runs without a slip (28, not 29)."""
RESTING = 0.99
REST_S = 0.05
QUIET_M = 1e-6
QUIET_TURN = 1e-5
"""A block is at rest if it moved less than QUIET_M and turned less than QUIET_TURN in each look of the last REST_S."""
SLIDE_M = 1e-3
"""A slide is at least so long; what comes to rest after one is a new contact with a new draw of friction."""
STILL_RAD_S = 1e-4
"""Joints that have reached their set-point and turn more slowly than this are brought to rest there."""
LEVEL_ENOUGH = 0.5
"""Utilisation below which a hand lets go of the block that it places."""
ABSENT_M = -1.0


class TwinWorld:
    """Arm, plate and block in MuJoCo, driven by `set_target` and `advance`; the same live and in lockstep.

    The world's z is up; the arm's base is the world unless `world_from_base` (4, 4) says otherwise. Whatever is random
    comes from `rng`: the same seed and the same calls give the same numbers. An `influence` is a mechanism beyond that.
    """

    def __init__(
        self,
        arm: ArmModel,
        *,
        friction: Friction,
        rng: np.random.Generator,
        joint_start_rad: Sequence[float],
        block: Block | None = None,
        plate: Plate | None = None,
        start_ns: int = 0,
        world_from_base: FLOATS | None = None,
        contact: Contact = EXACT,
        savings: bool = True,
        influence: Influence | None = None,
    ) -> None:
        self.arm, self.friction = arm, friction
        self._mechanism = Mechanism(influence, start_ns=start_ns)
        self.block, self.plate = block or Block(), plate or Plate()
        base = np.eye(4) if world_from_base is None else world_from_base
        scene = model.Scene(
            arm=arm,
            world_from_base=base,
            block=self.block,
            plate=self.plate,
            contact=contact,
            step_s=STEP_S,
            arm_step_s=LOOK_S,
        )
        self._n = len(arm.joints)
        start = np.array(joint_start_rad, dtype=np.float64)
        self._engines = Engines(scene, friction=friction, joint_start_rad=start)
        self._moved = self._engines.arm
        self._loose: BlockEngine | None = None
        self._servo = Servo(start, now_ns=start_ns)
        self._reach: list[float] = model.reach_m(arm).tolist()
        self._reach_m = math.hypot(*self._reach)
        self._motion = grip.PlateMotion(ahead_s=AHEAD_NS * 1e-9)
        self._rng, self._savings = rng, SAVING if savings else EVERYTHING
        self._time_ns = self._asked_ns = start_ns
        """The end of the look under way, which is less than a look ahead of the time asked for."""
        self._steps_left = 0
        """Steps of the look under way that a loose block has still to make."""
        self._looking = False
        """True from the arm's step until the look that follows it."""
        self._untaken = self._left_out = 0
        """Looks since the plate's motion was taken note of, and how many of them may be left out."""
        self._read: tuple[FLOATS, FLOATS, FLOATS] | None = None
        self.lost = 0
        """The number of times that the block left the plate, or fell over, and was put back on its centre."""
        self.place_block(0.0, 0.0, 0.0)

    # -- driving

    def set_target(self, position_rad: ArrayLike, velocity_rad_s: ArrayLike, *, stamp_ns: int | None = None) -> None:
        """Wants the joints at `position_rad` (n,) at `stamp_ns` (default: now), moving on at `velocity_rad_s` (n,).

        Arrays are kept as they are, and must not be written to again.

        Raises:
            ValueError: if there are not as many numbers as joints.
        """
        position, velocity = np.asarray(position_rad, np.float64), np.asarray(velocity_rad_s, np.float64)
        if len(position) != self._n or len(velocity) != self._n:
            raise ValueError(f"expected {self._n} joints, got {len(position)} and {len(velocity)}")
        self._servo.set_target(position, velocity, stamp_ns=self._asked_ns if stamp_ns is None else stamp_ns)
        self._resting = self._resting and self._servo.settled

    def advance(self, to_ns: int) -> None:
        """Lets simulated time pass until `to_ns`; what is read afterwards is the state at that very time."""
        self._asked_ns = max(to_ns, self._asked_ns)
        if not self._resting:
            self._pass_time()
            self._read = None
        if self._resting:
            self._time_ns = self._asked_ns

    def _pass_time(self) -> None:
        """Goes from look to look until the time asked for, or until all is at rest."""
        if self._looking:
            self._go_on()
        while not (self._looking or self._resting) and self._time_ns < self._asked_ns:
            self._begin_look()
            self._go_on()

    def _begin_look(self) -> None:
        """Commands the servos and moves the arm; a sudden command frees the block before it is carried out."""
        arm, servo = self._moved, self._servo
        wanted = servo.command(arm.servo_rad, now_ns=self._time_ns + AHEAD_NS)
        if self._loose is None and not self._held and self._shoves(servo.jerk_rad_s):
            self._unweld()
        arm.step(wanted_rad_s=wanted)
        self._time_ns += LOOK_NS
        self._steps_left, self._looking = LOOK, True
        self._untaken += 1
        if self._loose is not None and not self._left_out:
            self._take_motion()

    def _go_on(self) -> None:
        """Brings the look under way to its end, or a block that moves to its first step from the time asked for on."""
        late = self._time_ns - self._asked_ns
        if late > 0:
            if not self.block_at_rest:
                self._step_block(self._steps_left - late // STEP_NS)
            return
        if not (0 < self._untaken <= self._left_out and self._servo.moving):
            if self._untaken:
                self._take_motion()
            self._step_block(self._steps_left)
            self._look()
        self._steps_left, self._looking = 0, False

    def _step_block(self, count: int) -> None:
        """Moves a loose block as the plate moves under it meanwhile."""
        block = self._loose
        if block is None or count <= 0:
            return
        for _ in range(count):
            now_ns = self._time_ns - self._steps_left * STEP_NS
            further = self._mechanism.act(block, self._draw, now_ns=now_ns)
            step(block, self._motion, ago_s=self._steps_left * STEP_S, further=further)
            self._steps_left -= 1

    def _take_motion(self) -> None:
        """Notes how the plate has moved."""
        self._motion.take(self._moved.bodies, seconds=self._untaken * LOOK_S)
        self._untaken = 0

    def place_block(self, x_m: float, y_m: float, yaw_rad: float) -> None:
        """Lays the block on the plate, by a hand that lets go once the plate is level enough: a new contact.

        Raises:
            ValueError: if the block would not lie within the foam's cutout.
        """
        half = self.block.side_m / 2
        pose = (np.array([x_m]), np.array([y_m]), np.array([yaw_rad]))
        if self.plate.opening.room_m(np.array([half]), pose)[0] < 0.0:
            raise ValueError(f"expected a place within the foam's opening, got {x_m}, {y_m}")
        self.block_present = True
        self._rel = Pose((x_m, y_m, half), (math.cos(yaw_rad / 2), 0.0, 0.0, math.sin(yaw_rad / 2)))
        self._mechanism.slid_ns = self._asked_ns
        self._pending: FrictionDraw | None = None
        self._use(self.friction.draw(self._rng))
        self._weld()
        self._held, self._anchor, self._leaning = True, self._rel.position, (0.0, 0.0)

    def remove_block(self) -> None:
        """Takes the block off the plate; `place_block` brings it back."""
        self._weld()
        self._engines.make_absent()
        self._held, self.block_present = True, False
        self._seen = self._rel = Pose((0.0, 0.0, ABSENT_M), (1.0, 0.0, 0.0, 0.0))

    # -- reading

    @property
    def time_ns(self) -> int:
        """The time that the world was last advanced to."""
        return self._asked_ns

    @property
    def friction_now(self) -> FrictionDraw:
        """The true friction of the present contact."""
        return self._draw

    @property
    def mu_now(self) -> float:
        """The geometric mean of the present contact's coefficients."""
        return self._draw.mu

    @property
    def block_at_rest(self) -> bool:
        """True if the block lies still on the plate."""
        return self._loose is None or self._quiet_s >= REST_S

    def joint_arrays(self) -> tuple[FLOATS, FLOATS, FLOATS]:
        """Returns position (rad), velocity (rad/s) and effort (Nm) of the arm's joints now, each (n,).

        They are never written to again.

        They are the same arrays as long as all is at rest.
        """
        if self._read is None:
            self._read = self._moved.joints(self._share())
        return self._read

    def joints(self) -> Joints:
        """Returns the arm's joints now, as plain numbers."""
        position, velocity, effort = self.joint_arrays()
        return Joints(tuple(position.tolist()), tuple(velocity.tolist()), tuple(effort.tolist()))

    def plate_pose(self) -> PlatePose:
        """Returns the plate's pose now."""
        return plate_pose(self._moved.bodies_at(self._share()), pivot_above_plate_m=self.arm.pivot_above_plate_m)

    def plate_quaternion(self) -> Sequence[float]:
        """Returns world_from_plate now, (w, x, y, z), when nothing else of the plate is wanted."""
        return self._moved.plate_quaternion_at(self._share())

    def block_pose(self) -> Pose:
        """Returns the block's pose on the plate, as if its feet were hard (`standing`).

        It is at z = −1 m when there is none.
        """
        if self._loose is None or self._quiet_s >= REST_S or not self._looking:
            return self._seen
        ahead_s = (self._asked_ns - self._time_ns + self._steps_left * STEP_NS) * 1e-9
        return standing(self._loose.pose_after(ahead_s), half_m=self.block.side_m / 2)

    # -- within

    def _share(self) -> float:
        """Returns the share of the look under way that lies before the time asked for."""
        return 1.0 - (self._time_ns - self._asked_ns) / LOOK_NS

    def _shoves(self, jerk_rad_s: Sequence[float]) -> bool:
        """Returns true if a change of the joints' commanded velocities could make the block slip within one look.

        In a tilt the joints' parts cancel in the pivot. They do so in the wanted motion; their servos are not all
        equally quick, so a share of their sum is allowed for.
        """
        allowed_m_s = self._slack * LOOK_S
        # A product of lengths is never less than the sum of products, and that never less than what joints do together.
        at_most = (1 + UNEVEN) * self._reach_m * math.hypot(*jerk_rad_s)
        if at_most <= allowed_m_s:
            return False
        apart = sum(abs(jerk) * reach for jerk, reach in zip(jerk_rad_s, self._reach, strict=True))
        if (1 + UNEVEN) * apart <= allowed_m_s:
            return False
        return self._moved.speed_of_block(jerk_rad_s) + UNEVEN * apart > allowed_m_s

    def _look(self) -> None:
        """Decides every LOOK_S what the block does: it sticks, slides, comes to rest or leaves."""
        loose, self._left_out = self._loose, 0
        if loose is None:
            self._mind_grip()
        else:
            self._follow(loose)
            if self._loose is not None and self._quiet_s >= self._mind_at_s:
                self._mind_at_s = self._quiet_s + REST_S
                self._mind_rest(self._loose)
            if self._loose is not None:
                self._left_out = self._savings.looks_asleep(math.hypot(*self._leaning))
        if self._savings.skips and self._loose is loose and self._servo.settled and self._stuck():
            self._resting = self._moved.halt(below_rad_s=STILL_RAD_S)

    def _stuck(self) -> bool:
        """Returns true if the block stays where it is, on a plate that does not move."""
        # A block that the foam holds lies still beyond its friction, too: the foam is a spring that has come to rest.
        if self._held or not self.block_at_rest or any(self._leaning):
            return self._held or self.block_at_rest
        return self._utilisation(self._motion.needed(self._rel.position), self._hold) < RESTING

    def _mind_grip(self) -> None:
        """Releases a block that is a part of the plate when it could slip."""
        if not self.block_present:
            return
        force = self._motion.needed(self._rel.position)
        if not self._held:
            self._renew(force)
            if self._mechanism.influence is not None:
                self._hold = self._hold_by(self._draw)
        used = self._utilisation(force, self._hold)
        if self._held:
            if used < LEVEL_ENOUGH:
                self._held = False
                self._unweld()
            return
        limit = self._limit(LETS_GO)
        self._slack = self._hold.slack(force, share=limit)
        if used > limit:
            self._unweld()
        else:
            self._left_out = self._savings.looks_left_out(self._slack)
            self._slack -= self._left_out * SPENT_M_S2

    def _mind_rest(self, block: BlockEngine) -> None:
        """Minds a block that lies still by contact.

        It gets a new contact after a slide, or joins the plate if it holds well.
        """
        force, self._hold = self._motion.needed(self._rel.position), self._hold_by(self._draw)
        if self._seen.lean_rad > 3 * LEAN_RAD and self._utilisation(force, self._hold) < LEVEL_ENOUGH:
            self._pick_up()
            return
        if math.dist(self._anchor, self._seen.position) >= SLIDE_M:
            self._anchor = self._seen.position
            self._mechanism.slides += 1
            self._pending = self.friction.draw(self._rng)
        self._renew(force)
        self._leaning = self._engines.foam_push(block)
        if self._savings.welds and self._utilisation(force, self._hold) < self._limit(GRIPS):
            self._weld()
            self._slack = self._hold.slack(force, share=self._limit(LETS_GO))

    def _renew(self, force: grip.Three) -> None:
        """Lets a new draw take effect once it holds the block where it lies.

        Were it to act at once, a block that stopped on a still tilted plate would slide again whenever the draw is
        low, and draw again: the low draws would be lost, and the friction of the runs would not be the one set.
        """
        if self._pending and self._utilisation(force, self._hold_by(self._pending)) < GRIPS:
            self._use(self._pending)
            self._pending = None

    def _utilisation(self, force: grip.Three, hold: grip.Hold) -> float:
        used = hold.utilisation(force)
        x, y = self._leaning
        if x or y:  # the foam carries some of it, or pushes: either must do
            relieved = (force[0] - x, force[1] - y, force[2])
            used = max(used, hold.utilisation(relieved))
        return used

    def _hold_by(self, friction: FrictionDraw) -> grip.Hold:
        """Returns the hold of the block by that friction where it lies now."""
        yaw = self._rel.yaw_rad
        axis = self.friction.axis_rad + (yaw if self.friction.fixed_in == "object" else 0.0)
        friction = self._mechanism.at_rest(friction, self._rel.position, now_ns=self._time_ns)
        return grip.Hold(friction, axis_rad=axis, block_yaw_rad=yaw)

    def _limit(self, share: float) -> float:
        return share * (LEANING if any(self._leaning) else 1.0)

    def _use(self, draw: FrictionDraw) -> None:
        self._draw, self._hold = draw, self._hold_by(draw)
        self._engines.set_friction(draw)

    def _follow(self, block: BlockEngine) -> None:
        """Notes where a loose block is, whether it lies still, and whether it can reach the foam."""
        self._rel = block.pose_after(0.0)
        before, self._seen = self._seen, standing(self._rel, half_m=self.block.side_m / 2)
        moved = math.dist(before.position, self._seen.position)
        turned = math.dist(before.quaternion, self._seen.quaternion)
        quiet = moved < QUIET_M and turned < QUIET_TURN
        self._quiet_s = self._quiet_s + LOOK_S if quiet else 0.0
        if not quiet:
            self._leaning, self._mind_at_s = (0.0, 0.0), REST_S
        x, y, z = self._rel.position
        reach = math.hypot(x, y) + self.block.side_m * math.sqrt(0.5) + 2 * moved + 1e-3
        if reach > self.plate.side_m or z < 0:
            self._pick_up()
        else:
            self._loose = self._engines.within_reach(block, reach_m=reach)

    def _pick_up(self) -> None:
        """Puts back a block that has left the plate, or lies on the level plate tipped over or askew."""
        self.lost += 1
        self.place_block(0.0, 0.0, 0.0)

    def _weld(self) -> None:
        """Makes the block a part of the plate where it is."""
        self._engines.weld(self._rel)
        self._loose = None
        self._seen = standing(self._rel, half_m=self.block.side_m / 2)
        self._quiet_s = self._mind_at_s = REST_S
        self._slack = 0.0
        self._left_out = 0
        self._resting = False

    def _unweld(self) -> None:
        """Makes the block a body of its own again, moving with the plate."""
        self._loose = self._engines.unweld(self._rel)
        settle(self._loose, self._motion, self._draw)
        self._mechanism.let_go()
        self._quiet_s = 0.0
