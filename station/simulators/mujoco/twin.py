"""The twin on the bus: it takes joint set-points as an arm does, and tells the synthetic camera what to draw."""

from __future__ import annotations

from shared.bus import Bus, Received
from shared.errors import UserError
from shared.messages import JointState, JointTarget, TwinScene
from station.simulators.mujoco.world import TwinWorld

NAME = "twin"


class Twin:
    """A `TwinWorld` between topics: reads `twin/target`, publishes `twin/joints` and `truth/scene`.

    It has no clock: whoever owns it says what time it is, a real clock or a simulated one. The scene is published at
    every tick that is at least `scene_period_ns` after the last one.
    """

    def __init__(self, bus: Bus, world: TwinWorld, *, scene_period_ns: int = 0) -> None:
        self._bus, self.world = bus, world
        self._names = world.arm.joint_names
        self._targets: list[JointTarget] = []
        self._scene_period_ns, self._next_scene_ns = scene_period_ns, world.time_ns
        bus.subscribe("twin/target", self._take_target)
        bus.announce(NAME)

    def tick(self, now_ns: int) -> None:
        """Lets the world catch up with `now_ns` and says what has come of it.

        Each set-point counts from its own time on, so that the arm moves alike however rarely the twin is asked.
        """
        for target in self._targets:
            self.world.advance(min(target.stamp_ns, now_ns))
            self.world.set_target(target.position_rad, target.velocity_rad_s, stamp_ns=target.stamp_ns)
        self._targets.clear()
        self.world.advance(now_ns)
        self._bus.publish("twin/joints", self.joint_state(now_ns))
        self.show(now_ns)

    def show(self, now_ns: int) -> None:
        """Publishes the scene if it is due."""
        if now_ns >= self._next_scene_ns:
            self._next_scene_ns = now_ns + self._scene_period_ns
            if self._bus.carries("truth/scene"):
                self._bus.publish("truth/scene", self.scene(now_ns))

    def joint_state(self, now_ns: int) -> JointState:
        """Returns the readings of the joints' sensors."""
        joints = self.world.joints()
        return JointState(
            stamp_ns=now_ns,
            name=self._names,
            position_rad=joints.position_rad,
            velocity_rad_s=joints.velocity_rad_s,
            effort_nm=joints.effort_nm,
        )

    def scene(self, now_ns: int) -> TwinScene:
        """Returns the truth of this moment; a block that is not there is said to be a metre below the plate."""
        world = self.world
        plate, block = world.plate_pose(), world.block_pose()
        (qw, qx, qy, qz), (px, py, pz) = plate.quaternion, plate.pivot_m
        (x, y, z), (bw, bx, by, bz) = block.position, block.quaternion
        # The fields are given by position, in the order of the class: it is made a hundred times a second.
        return TwinScene(now_ns, qw, qx, qy, qz, px, py, pz, x, y, z, bw, bx, by, bz, world.mu_now)

    def _take_target(self, received: Received) -> None:
        target = received.message
        if not isinstance(target, JointTarget):
            return
        if len(target.position_rad) != len(self._names) or len(target.velocity_rad_s) != len(self._names):
            wrong = UserError(
                f"Expected set-points for the {len(self._names)} joints of {self.world.arm.name}, got"
                f" {len(target.position_rad)}: give the arm agent and the twin the same rig file"
            )
            self._bus.leave_out(received.topic, wrong)
            return
        self._targets.append(target)
