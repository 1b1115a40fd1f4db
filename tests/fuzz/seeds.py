"""Small valid recordings that inputs are made of: two runs made by hand, and the beginning of the golden session."""

from __future__ import annotations

from functools import cache
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory

from shared import frames
from shared.messages import ArmLease, BlockPose, Environment, Heartbeat, MarkerCorners, Message
from station.recording.reader import open_recording
from station.recording.writer import Recording
from tests.unit.app.forging import forged
from tests.unit.recording.session import START_NS, provenance, traffic

GOLDEN = Path(__file__).parents[1] / "golden" / "session.mcap"
_OF_THE_GOLDEN = 900
_EACH = 7
"""One in so many of the frequent messages is kept."""


@cache
def bench() -> bytes:
    """Two runs made by hand, with every topic that a reader looks at."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "bench.mcap"
        rig = 'id = "bench"\n[block]\nmass_kg = 0.01\n[camera]\nrate_hz = 90.0\n'
        plan = "samples = 2\nseed = 3\n[tilt]\nsteps = 20\n"
        with Recording(path, provenance=provenance(rig_toml=rig, plan_toml=plan)) as recording:
            for number, (receive_ns, topic, message) in enumerate(traffic()):
                frequent = topic in ("arm/platform", "arm/joints", "truth/scene", "camera/corners")
                if number % _EACH == 0 or not frequent:
                    recording.write_message(topic, message, receive_ns=receive_ns)
            for second in range(3):
                now_ns = START_NS + second * 10**9
                for topic, message in _further(now_ns):
                    recording.write_message(topic, message, receive_ns=now_ns)
        return path.read_bytes()


def _further(now_ns: int) -> tuple[tuple[str, Message], ...]:
    corners = MarkerCorners(capture_ns=now_ns, corners_px=(1.0,) * 8, found=True, marker_id=1)
    return (
        ("session/heartbeat", Heartbeat(stamp_ns=now_ns, armed=True, owner="bench")),
        ("arm/lease", ArmLease(stamp_ns=now_ns, owner="bench")),
        ("environment", Environment(stamp_ns=now_ns, temperature_c=21.0)),
        ("block/pose", BlockPose(stamp_ns=now_ns, found=True)),
        ("camera/plate", corners),
        ("camera/image", frames.image(b"\xff\xd8\xff\xd9", stamp_ns=now_ns)),
    )


@cache
def session() -> bytes:
    """The first seconds of a session that can be replayed."""
    with TemporaryDirectory() as folder:
        path = forged(GOLDEN, Path(folder) / "cut.mcap", lambda items: islice(items, _OF_THE_GOLDEN))
        return path.read_bytes()


@cache
def messages_of(data: bytes) -> tuple[tuple[str, bytes, int, int], ...]:
    """Topic, payload and both times of every message of a recording."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "seed.mcap"
        path.write_bytes(data)
        found = open_recording(path).messages(truth=True)
        return tuple((item.topic, item.payload, item.log_ns, item.publish_ns) for item in found)
