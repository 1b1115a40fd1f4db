"""The frame ring, the preview and the full frames on request."""

import threading

import cv2
import numpy as np
import pytest

from pi_agent.calibration.model import nominal
from pi_agent.frame_ring import FrameRing
from pi_agent.preview import Preview, View
from shared.bus import Received
from shared.clock import SimulatedClock
from shared.foxglove import CompressedImage, PointCloud
from shared.memory_bus import MemoryBus
from shared.messages import FrameRequest, MarkerCorners
from tests.unit.pi_agent.rigs import rig

FRAME_NS = 10_000_000
START_NS = SimulatedClock().now_ns()
CORNERS = (100.0, 120.0, 160.0, 120.0, 160.0, 180.0, 100.0, 180.0)


def ring_of(count: int, *, seconds: float = 0.5) -> FrameRing:
    ring = FrameRing(height_px=600, width_px=600, rate_hz=100.0, seconds=seconds)
    for number in range(count):
        fill(ring, number)
    return ring


def fill(ring: FrameRing, number: int) -> None:
    image = np.full((600, 600), number % 256, dtype=np.uint8)
    ring.put(image, MarkerCorners(capture_ns=START_NS + number * FRAME_NS, corners_px=CORNERS, found=True))


def test_the_ring_keeps_the_last_frames_only():
    ring = ring_of(60)
    assert ring.capacity == 50
    assert ring.stamps() == [START_NS + number * FRAME_NS for number in range(10, 60)]
    latest, oldest = ring.latest(), ring.next_after(0)
    assert latest is not None
    assert oldest is not None
    assert (latest.image[0, 0], oldest.image[0, 0]) == (59, 10)
    assert ring.next_after(START_NS + 59 * FRAME_NS) is None


def test_a_kept_frame_is_a_copy():
    ring = ring_of(1)
    kept = ring.latest()
    for number in range(1, 60):
        fill(ring, number)
    assert kept is not None
    assert kept.image.max() == 0


def test_the_ring_stays_within_its_memory():
    ring = FrameRing(height_px=4000, width_px=4000, rate_hz=100.0)
    assert ring.capacity * 16_000_000 <= 96 * 2**20


class Studio:
    """A preview on a bus within the process, driven frame by frame."""

    def __init__(self, *, rate_hz: float = 10.0) -> None:
        self.clock = SimulatedClock()
        self.bus = MemoryBus(self.clock)
        self.images: list[CompressedImage] = []
        self.clouds: list[PointCloud] = []
        self.bus.subscribe("camera/image", self._keep)
        self.bus.subscribe("camera/image/overlay", self._keep)
        self.preview = Preview(self.bus, self.clock, rate_hz=rate_hz, jpeg_quality=80)
        self.ring = FrameRing(height_px=600, width_px=600, rate_hz=100.0, seconds=0.5)

    def _keep(self, received: Received) -> None:
        message = received.message
        if isinstance(message, CompressedImage):
            self.images.append(message)
        elif isinstance(message, PointCloud):
            self.clouds.append(message)

    def attach(self) -> None:
        config = rig()
        self.preview.attach(View(self.ring, nominal(config, width_px=600, height_px=600), 0.29, 100.0))

    def show(self, first: int, last: int) -> None:
        for number in range(first, last):
            self.clock.advance_to(START_NS + number * FRAME_NS)
            fill(self.ring, number)
            self.preview.frame_came(START_NS + number * FRAME_NS)
            self.preview.work()

    @property
    def numbers(self) -> list[int]:
        return [(image.timestamp.ns - START_NS) // FRAME_NS for image in self.images]


def test_the_preview_comes_at_its_own_rate():
    studio = Studio(rate_hz=12.0)
    studio.attach()
    studio.show(0, 200)
    assert len(studio.images) == pytest.approx(24, abs=1)
    assert len(studio.clouds) == len(studio.images)
    picture = cv2.imdecode(np.frombuffer(studio.images[-1].data, np.uint8), cv2.IMREAD_GRAYSCALE)
    assert picture is not None
    assert picture.shape == (600, 600)
    assert abs(int(picture[0, 0]) - studio.numbers[-1] % 256) <= 2


def test_no_preview_at_rate_zero():
    studio = Studio(rate_hz=0.0)
    studio.attach()
    studio.show(0, 30)
    assert studio.images == []


def test_every_frame_of_a_past_and_coming_stretch_is_sent_once():
    studio = Studio(rate_hz=0.0)
    studio.attach()
    studio.show(0, 40)
    wanted = FrameRequest(from_ns=START_NS + 20 * FRAME_NS, to_ns=START_NS + 59 * FRAME_NS)
    reply = studio.preview.request(wanted)
    assert (reply.frames, reply.reason) == (40, "")
    studio.show(40, 80)
    assert studio.numbers == list(range(20, 60))


def test_frames_that_were_overwritten_meanwhile_are_left_out():
    studio = Studio(rate_hz=0.0)
    studio.attach()
    studio.show(0, 10)
    studio.preview.request(FrameRequest(from_ns=START_NS, to_ns=START_NS + 99 * FRAME_NS))
    for number in range(10, 100):  # frames come, but the thread gets no time
        fill(studio.ring, number)
    studio.clock.advance_to(START_NS + 99 * FRAME_NS)
    studio.preview.work()
    assert studio.numbers == list(range(50, 100))


@pytest.mark.parametrize(
    ("start", "end", "said"),
    [(5, 2, "expected to_ns after from_ns"), (0, 10_000, "at most 30 s"), (-900, -800, "is kept any more")],
)
def test_a_request_that_cannot_be_met_is_refused(start: int, end: int, said: str):
    studio = Studio()
    studio.attach()
    studio.show(0, 10)
    reply = studio.preview.request(FrameRequest(from_ns=START_NS + start * FRAME_NS, to_ns=START_NS + end * FRAME_NS))
    assert reply.frames == 0
    assert said in reply.reason


def test_without_a_camera_there_is_nothing_to_ask_for():
    assert "not delivered" in Studio().preview.request(FrameRequest(from_ns=1, to_ns=2)).reason


def test_the_thread_ends_when_told():
    studio, stop = Studio(), threading.Event()
    thread = threading.Thread(target=studio.preview.run, args=(stop,))
    thread.start()
    stop.set()
    thread.join(timeout=5)
    assert not thread.is_alive()
