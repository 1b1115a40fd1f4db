"""`station replay --bus` and `--live` as real processes over real sockets of the loopback address."""

from __future__ import annotations

import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import pytest

from shared.bus import Received
from shared.bus_rights import OBSERVER
from shared.rig import load_rig
from shared.zenoh_bus import ZenohBus
from station.recording.reader import open_recording
from station.view import viewer
from station.view.live import LiveView
from station.view.setup import Setup
from tests.patience import PATIENCE_S
from tests.system.ports import free_port
from tests.unit.view import session
from tests.unit.view.mcap_file import write_mcap

pytestmark = pytest.mark.system


@pytest.fixture
def rig_path(tmp_path: Path) -> Path:
    camera, arm, station = (f"tcp/127.0.0.1:{free_port()}" for _ in range(3))
    path = tmp_path / "rig.toml"
    path.write_text(f'id = "playback"\n[bus]\ncamera = "{camera}"\narm = "{arm}"\nstation = "{station}"\n')
    return path


@contextmanager
def station(*words: str | Path) -> Generator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "station", *(str(word) for word in words)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.terminate()
        try:
            process.communicate(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()


def test_a_subscriber_gets_the_same_messages(rig_path: Path, tmp_path: Path) -> None:
    recording = write_mcap(tmp_path / "session.mcap", session.session_messages())
    recorded: defaultdict[str, list[bytes]] = defaultdict(list)
    for item in open_recording(recording).messages():
        recorded[item.topic].append(item.payload)
    heard: defaultdict[str, list[bytes]] = defaultdict(list)

    def hear(received: Received) -> None:
        heard[received.topic].append(received.payload)

    rig = load_rig(rig_path)
    with ZenohBus(rig.id, connect=rig.bus.peers("view")) as bus:
        for topic in recorded:
            bus.subscribe(topic, hear)
        with station("replay", "--bus", recording, "--rig", rig_path, "--speed", "2") as process:
            seen: set[str] = set()
            end = time.monotonic() + PATIENCE_S
            while process.poll() is None and time.monotonic() < end:
                bus.poll(0.05)
                seen |= bus.alive()
            output = process.communicate(timeout=PATIENCE_S)[0]
        bus.poll(0.2)
    assert process.returncode == 0, output
    assert seen == {"camera", "arm", "twin", "station"}
    assert f"{sum(map(len, recorded.values()))} messages" in output
    assert {topic: len(payloads) for topic, payloads in heard.items()} == {
        topic: len(payloads) for topic, payloads in recorded.items()
    }
    assert heard == recorded


@pytest.mark.skipif(not viewer.can_draw_headless(), reason="no Vulkan driver: apt-get install mesa-vulkan-drivers")
def test_the_live_view_draws_a_playback_and_ends_with_it(rig_path: Path, tmp_path: Path) -> None:
    recording = write_mcap(tmp_path / "session.mcap", session.session_messages())
    port = free_port()
    live_words = ("replay", "--live", "--no-viewer", "--rig", rig_path, "--port", str(port))
    with station(*live_words) as live, viewer.headless(size=(900, 600)) as client:
        assert live.stdout is not None
        assert f"rerun+http://127.0.0.1:{port}/proxy" in live.stdout.readline()
        client.open(f"rerun+http://127.0.0.1:{port}/proxy")
        with station("replay", "--bus", recording, "--rig", rig_path) as playing:
            assert playing.wait(PATIENCE_S) == 0
        assert live.wait(PATIENCE_S) == 0
        state = client.get_state()
    ends = {line.name: line.end for line in state.recordings[0].timelines}
    assert ends["elapsed"] == pytest.approx(session.END_S * 1e9, rel=0.02)
    assert [view.name for view in state.views if view.reports] == []
    assert len(state.views) == 11


def test_the_live_view_goes_on_after_a_lost_link_and_ends_with_the_station(rig_path: Path) -> None:
    rig = load_rig(rig_path)
    with station("replay", "--live", "--no-viewer", "--rig", rig_path, "--port", str(free_port())) as live:
        assert live.stdout is not None
        assert "rerun" in live.stdout.readline()  # it is on the bus: who came before was not seen
        for _ in range(2):  # nobody is there for a moment in between, as when a link is made again
            with ZenohBus.of("station", rig) as bus:
                bus.announce("station")
                watcher = ZenohBus.of(OBSERVER, rig)
                while "station" not in watcher.alive():
                    watcher.poll(0.05)
                watcher.close()
                time.sleep(2.0)
                assert live.poll() is None
        assert live.wait(PATIENCE_S) == 0


@pytest.mark.skipif(not viewer.can_draw_headless(), reason="no Vulkan driver: apt-get install mesa-vulkan-drivers")
def test_a_viewer_that_is_killed_holds_nobody_up() -> None:
    items = list(session.session_messages())
    half = len(items) // 2
    with LiveView(setup=Setup(), port=0) as view:
        with viewer.headless(size=(600, 400)) as client:
            client.open(view.uri)
            for topic, message, stamp in items[:half]:
                view.take(Received(topic, receive_ns=stamp, message=message))
            while not client.get_state().recordings:
                time.sleep(0.1)
        for topic, message, stamp in items[half:]:  # the viewer was killed without a word
            view.take(Received(topic, receive_ns=stamp, message=message))
    assert view.fault == ""
    assert not view.dropped
