"""The arm agent: commands come in from the bus, pass planner and gate, and reach the driver; state goes out.

`tick(now_ns)` drives everything, in real time by `station.arm.loop` and in simulated time by the lockstep scheduler.
The agent goes on watching, holding and levelling when the station is gone.
"""

from __future__ import annotations

from shared.bus import Bus, Received
from shared.errors import UserError
from shared.messages import ArmReply, ArmStop, Heartbeat, Message, TiltCommand
from station.arm.announcements import WARNING, Announcements, Moment
from station.arm.drivers import Driver, DriverLink, load_driver
from station.arm.gate import Action, SafetyGate
from station.arm.kept import Kept
from station.arm.lease import FUTURE_NS
from station.arm.lease_and_stop import LeaseAndStop
from station.arm.motions import Motions
from station.arm.tilter import Tilter
from station.rig.arm_settings import ArmSettings


class ArmAgent:
    """Joins one arm to the bus. Build it with `arm_agent`."""

    def __init__(
        self,
        bus: Bus,
        *,
        tilter: Tilter,
        driver: Driver,
        gate: SafetyGate,
        settings: ArmSettings,
        kept: Kept | None = None,
    ) -> None:
        self._tilter, self._driver, self._gate = tilter, driver, gate
        self._moment = moment = Moment()
        self._ahead = False
        self._announce = announce = Announcements(bus, moment, tilter.stage)
        self._lease = LeaseAndStop(bus, moment, gate=gate, announce=announce, kept=kept)
        self._motions = Motions(moment, tilter=tilter, driver=driver, gate=gate, settings=settings, announce=announce)
        bus.serve("arm/lease", self._lease.claim)
        bus.serve("arm/command", self._on_command)
        bus.serve("arm/stop", self._on_stop)
        bus.subscribe("session/heartbeat", self._on_heartbeat)
        bus.announce("arm")

    @property
    def tilter(self) -> Tilter:
        """The planner's memory: the arm in its place and the paths already solved."""
        return self._tilter

    # --- from the bus -------------------------------------------------------------------------------------------------

    def _on_heartbeat(self, received: Received) -> None:
        if isinstance(received.message, Heartbeat):
            self._lease.heartbeat(received.message)

    def _on_stop(self, message: Message) -> ArmReply:
        self.stop(message.reason if isinstance(message, ArmStop) else "")
        return ArmReply(accepted=True)

    def stop(self, reason: str) -> None:
        """Stops the arm with the next tick, by the bus or by a signal, until the next session arms it."""
        self._lease.stop(reason)

    def _on_command(self, message: Message) -> ArmReply:
        if not isinstance(message, TiltCommand):
            return ArmReply(reason="Expected a TiltCommand.")
        try:
            self._motions.accept(message)
        except UserError as refused:
            self._announce.log(WARNING, f"command refused: {refused}")
            return self._reply(message, reason=str(refused))
        return self._reply(message)

    def _reply(self, command: TiltCommand, *, reason: str = "") -> ArmReply:
        passing = bool(reason) and self._gate.beat_lost()
        return ArmReply(not reason, reason, self._moment.now_ns, command.run, command.step, passing)

    # --- time ---------------------------------------------------------------------------------------------------------

    def tick(self, now_ns: int) -> None:
        """Does everything that is due at `now_ns`: stops, begins what was accepted, drives, watches, publishes.

        All that moves the arm is done here, for this moment: requests come at other times, and only say what is wanted.
        """
        self._moment.now_ns = now_ns
        if self._gate.stopped:
            self._motions.halt(f"emergency stop: {self._gate.stopped}")
        self._motions.begin_waiting()
        self._motions.revoke()
        self._driver.tick(now_ns)
        self._read(now_ns)
        self._watch(now_ns)
        self._motions.finish()
        self._announce.state()
        self._lease.tick()

    def _read(self, now_ns: int) -> None:
        """Takes the driver's reading, unless it is of a time to come: by a wrong stamp all after it would be old."""
        reading = self._driver.read()
        ahead_ns = 0 if reading is None else reading.stamp_ns - now_ns
        told, self._ahead = self._ahead, ahead_ns > FUTURE_NS
        if not self._ahead:
            self._moment.reading = reading
        elif not told:
            text = f"the arm's joint states are stamped {ahead_ns * 1e-9:.3g} s ahead and not taken: see to its clock"
            self._announce.log(WARNING, text)

    def _watch(self, now_ns: int) -> None:
        motions = self._motions
        verdict = self._gate.watch(now_ns=now_ns, reading=self._moment.reading, commanded=motions.commanded())
        if fault := self._driver.fault():
            self._lose(fault)
        elif verdict.action is Action.NONE:
            self._announce.all_well()
            motions.watched()
        elif verdict.action is Action.HALT:
            motions.halt(verdict.reason)
        elif verdict.action is Action.HOLD:
            motions.hold(verdict.reason, passing=True)
        else:
            motions.level(verdict.reason)

    def _lose(self, fault: str) -> None:
        """Halts an arm that does not do its part; one that rests may be commanded again, which ends the fault."""
        if self._motions.under_way:
            self._motions.halt(fault)
        else:
            self._announce.once(fault)
            self._tilter.forget()

    def close(self, *, now_ns: int | None = None) -> None:
        """Holds the arm, now or else as of the last tick, and lets go of the driver."""
        self._moment.now_ns = self._moment.now_ns if now_ns is None else now_ns
        self._motions.halt("the arm agent ends")
        self._driver.close()


def arm_agent(
    bus: Bus,
    settings: ArmSettings,
    *,
    driver: Driver | None = None,
    tilter: Tilter | None = None,
    kept: Kept | None = None,
) -> ArmAgent:
    """Returns the agent for the `[arm]` table of a rig: model, placement, driver and gate put together.

    A `tilter` of these settings that has not moved yet brings the paths that it has solved. `kept` brings the stop that
    an agent before has left in force, and who claimed the arm; an arm within a process, which nobody can start again,
    needs none. Raises UserError with one sentence when they do not fit.
    """
    tilter = tilter or Tilter.from_settings(settings)
    if driver is None:
        share = settings.gate.acceleration_share
        link = DriverLink(bus=bus, model=tilter.stage.model, options=settings.options, acceleration_share=share)
        driver = load_driver(settings.driver, link=link)
    stopped, claimed_by = (kept.stop.read(), kept.claimed_by.read()) if kept is not None else ("", "")
    gate = SafetyGate(
        tilter.stage,
        settings=settings.gate,
        may_arm=settings.may_arm,
        stopped=stopped,
        claimed_by=claimed_by or None,
    )
    return ArmAgent(bus, tilter=tilter, driver=driver, gate=gate, settings=settings, kept=kept)
