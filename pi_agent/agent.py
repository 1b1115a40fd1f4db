"""The camera agent: camera to tracker to bus. It reports what it saw and knows nothing of runs.

Threads: the camera's (read, track), the outbox's (publish), the preview's (JPEG), and the caller's of `run` (status,
services). Only the first is on the way from a frame to its corners.
"""

from __future__ import annotations

import dataclasses
import secrets
import sys
import threading
import time

import cv2

from pi_agent.calibration.model import Calibration, calibration_message, geometry_message, nominal
from pi_agent.cameras import Camera, CameraInfo, Frame
from pi_agent.capture import Capture
from pi_agent.diagnosis import Diagnosis
from pi_agent.frame_ring import FrameRing
from pi_agent.health import ProcessorMeter, Watchdog, temperature_c
from pi_agent.journal import NAME, Journal
from pi_agent.marks import require_visible
from pi_agent.observer import Observer
from pi_agent.outbox import Outbox
from pi_agent.preview import Preview, View
from pi_agent.trouble import Trouble
from shared.bus import Bus
from shared.clock import Clock
from shared.errors import UserError
from shared.installed import version
from shared.messages import AgentStatus, ClockPing, ClockPong, FrameReply, FrameRequest, MarkerCorners, Message
from shared.rig import RigConfig

STATUS_S = 1.0
SWITCH_S = 0.0005
"""A thread that waits for the interpreter gets it after this; the default of 5 ms would be half a frame."""


class Agent:
    """Runs one camera for one rig."""

    def __init__(
        self,
        rig: RigConfig,
        camera: Camera,
        bus: Bus,
        clock: Clock,
        *,
        calibration: Calibration | None = None,
        watchdog: Watchdog | None = None,
    ) -> None:
        known = calibration or nominal(rig, width_px=rig.camera.width_px, height_px=rig.camera.height_px)
        # A mark that no camera sees would open it again and again, which mends nothing.
        require_visible(rig, camera_m=known.camera_m[2])
        self._rig, self._bus, self._clock = rig, bus, clock
        self._measured, self._watchdog = calibration, watchdog or Watchdog()
        self.boot_id = secrets.randbits(62) | 1
        self._outbox, self._said_lost = Outbox(bus), 0
        self._journal = Journal(self._outbox.put, clock)
        self._trouble = Trouble(self._journal)
        config = rig.camera
        self._preview = Preview(bus, clock, rate_hz=config.preview_hz, jpeg_quality=config.jpeg_quality)
        self._capture = Capture(camera, on_open=self._opened, on_frame=self._took, journal=self._journal)
        self._info: CameraInfo | None = None
        self._frames, self._dropped_before, self._dropped = 0, 0, 0
        self._next_seq, self._seq_shift = 0, 0
        self._fresh = True
        self._exposure_ns, self._gain = 0, 0.0
        self._picture_fault, self._said_fault = "", ""

    # --- the camera's thread -----------------------------------------------------------------------------------------

    def _opened(self, info: CameraInfo) -> None:
        """Takes the camera's facts; one that comes back as it was keeps its trackers, and so the corners' identity."""
        self._fresh = True
        self._dropped_before += self._dropped
        self._dropped = 0
        if info == self._info:
            return
        self._journal.info(f"Camera open: {info}")
        self._check_rate(info)
        self._exposure_ns, self._gain = info.exposure_ns, info.gain
        self.calibration = self._calibration_for(info)
        self._observer = Observer(self._rig, info, boot_id=self.boot_id, calibration=self.calibration)
        self._diagnosis = Diagnosis(info)
        self._ring = FrameRing(height_px=info.height_px, width_px=info.width_px, rate_hz=info.rate_hz)
        depth_m = self.calibration.camera_m[2] - self._rig.block.size_m[2]
        self._preview.attach(View(self._ring, self.calibration, depth_m, info.rate_hz))
        self._info = info  # last: the caller's thread takes it as the sign that all the others are there

    def _check_rate(self, info: CameraInfo) -> None:
        wanted_hz = self._rig.camera.rate_hz
        if info.rate_hz < 0.99 * wanted_hz:
            self._journal.warning(f"The camera gives {info.rate_hz:.2f} Hz where rate_hz asks for {wanted_hz:.2f}")

    def _calibration_for(self, info: CameraInfo) -> Calibration:
        known = self._measured or nominal(self._rig, width_px=info.width_px, height_px=info.height_px)
        if (known.width_px, known.height_px) != (info.width_px, info.height_px):
            raise UserError(
                f"Expected a calibration for {info.width_px} x {info.height_px} pixels, got {known.source} for "
                f"{known.width_px} x {known.height_px}: run `pi-agent calibrate` again, or clear 'camera.calibration'"
            )
        return known

    def _took(self, frame: Frame) -> None:
        wrong = self._diagnosis.format_fault(frame.image)
        if wrong:
            raise UserError(wrong)
        if self._fresh:  # the driver counts anew; our count goes on
            self._seq_shift, self._fresh = self._next_seq - frame.seq, False
        self.process(dataclasses.replace(frame, seq=frame.seq + self._seq_shift))
        if not self._observer.repeated:  # a frozen camera is a dead one: the watchdog has the agent started again
            self._watchdog.fresh_frame()

    def process(self, frame: Frame) -> MarkerCorners:
        """Tracks a frame and sends what was seen; returns the block's corners."""
        corners = self._observer.block(frame)
        self._outbox.put("camera/corners", corners)
        self._ring.put(frame.image, corners)
        self._preview.frame_came(frame.capture_ns)
        for report in self._observer.plate(frame):
            self._outbox.put("camera/plate", report)
        self._frames += 1
        self._dropped, self._next_seq = frame.dropped, frame.seq + 1
        self._exposure_ns, self._gain = corners.exposure_ns, frame.gain or self._gain
        self._diagnose(frame, corners)
        return corners

    def _diagnose(self, frame: Frame, corners: MarkerCorners) -> None:
        self._picture_fault = self._diagnosis.see(frame, corners)
        assumed = self._observer.identity == "assumed"
        self._trouble.see(self._picture_fault, capture_ns=frame.capture_ns, assumed=assumed)

    # --- the caller's thread -----------------------------------------------------------------------------------------

    def run(self, stop: threading.Event) -> None:
        """Works until `stop` is set. Faults are said in status and log, and mended when their cause is gone."""
        sys.setswitchinterval(SWITCH_S)
        cv2.setNumThreads(1)  # its helpers would take the cores that tracking needs
        self._journal.info(f"Camera agent {version()} of rig {self._rig.id} starts: driver {self._rig.camera.driver}")
        self._bus.serve("camera/clock", self._answer_clock, direct=True)
        self._bus.serve("camera/frames", self._answer_frames)
        self._bus.announce(NAME)
        outbox_stop = threading.Event()
        workers = [
            threading.Thread(target=self._capture.run, args=(stop,), name="camera", daemon=True),
            threading.Thread(target=self._preview.run, args=(stop,), name="preview", daemon=True),
        ]
        sender = threading.Thread(target=self._outbox.run, args=(outbox_stop,), name="outbox", daemon=True)
        for thread in (*workers, sender):
            thread.start()
        self._watchdog.ready()
        self._attend(stop)
        self._watchdog.stopping()
        for thread in workers:
            thread.join(timeout=3.0)
        self._journal.info(f"Camera agent ends after {self._frames} frames, {self._total_dropped} dropped")
        outbox_stop.set()
        sender.join(timeout=3.0)

    def _attend(self, stop: threading.Event) -> None:
        meter, due_s = ProcessorMeter(), time.monotonic()
        counted, counted_s, rate_hz = 0, due_s, 0.0
        while not stop.is_set():
            if self._bus.poll(0.05) == 0:
                stop.wait(0.01)  # a bus within one process does not wait itself
            now_s = time.monotonic()
            if now_s >= due_s or self.fault != self._said_fault:
                if now_s >= due_s:  # a fault that changes within the second leaves too few frames to tell a rate
                    due_s = max(due_s + STATUS_S, now_s)
                    frames, passed_s = self._frames, max(now_s - counted_s, 1e-3)
                    rate_hz, counted, counted_s = (frames - counted) / passed_s, frames, now_s
                self._publish_status(rate_hz=rate_hz, cpu_percent=meter.percent())

    @property
    def fault(self) -> str:
        """One sentence on what is wrong now, or empty."""
        return self._capture.fault or self._picture_fault

    @property
    def _total_dropped(self) -> int:
        return self._dropped_before + self._dropped

    def _publish_status(self, *, rate_hz: float, cpu_percent: float) -> None:
        now_ns = self._clock.now_ns()
        self._said_fault = self.fault
        if self._outbox.lost > self._said_lost:
            self._said_lost = self._outbox.lost
            self._journal.warning(f"{self._said_lost} messages could not be sent: is the station's link stuck?")
        status = AgentStatus(
            stamp_ns=now_ns,
            frames=self._frames,
            dropped=self._total_dropped,
            queue=len(self._outbox),
            exposure_ns=self._exposure_ns,
            gain=self._gain,
            temperature_c=temperature_c(),
            cpu_percent=cpu_percent,
            version=version(),
            fault=self._said_fault,
            rate_hz=rate_hz,
            boot_id=self.boot_id,
        )
        self._bus.publish("camera/status", status)
        self._watchdog.say(self._said_fault or f"{rate_hz:.1f} frames/s, {status.dropped} dropped")
        if self._info is not None:
            self._bus.publish("camera/calibration", calibration_message(self.calibration, stamp_ns=now_ns))
            self._bus.publish("camera/geometry", geometry_message(self.calibration, self._rig, stamp_ns=now_ns))

    def _answer_clock(self, ping: Message) -> Message:
        station_ns = ping.station_ns if isinstance(ping, ClockPing) else 0
        return ClockPong(station_ns=station_ns, agent_ns=self._clock.now_ns())

    def _answer_frames(self, wanted: Message) -> Message:
        return self._preview.request(wanted) if isinstance(wanted, FrameRequest) else FrameReply(reason="not a request")
