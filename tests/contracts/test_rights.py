"""Rights hold for every role, and for everyone without rights, against every topic and every service of a rig."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Generator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import pytest

from shared import bus_watch
from shared.bus_rights import ROLES, sent_by
from shared.config import Table
from shared.messages import Message
from shared.rig import RigConfig, rig_of_table
from shared.topics import ANGLE_PREFIX, SERVICES, TOPICS
from shared.zenoh_bus import ZenohBus
from station.app import authority
from tests.contracts.least import least
from tests.patience import PATIENCE_S
from tests.system.ports import free_port

SETTLE_S = 1.5
"""Links stand and declarations arrive in this time, on a busy machine too; what is awaited is waited for longer."""
SERVING = ("camera", "arm", "station")
"""The processes that serve something."""
OUTSIDERS = ("revoked camera", "expired station", "stranger")


def rig_on(*ports: int) -> RigConfig:
    at = dict(zip(SERVING, (f"tls/127.0.0.1:{port}" for port in ports), strict=True))
    return rig_of_table(Table({"id": "rights", "bus": at}))


@dataclass(frozen=True)
class Agents:
    """Camera agent, arm agent and station, which hear everything and serve every service, whoever's it is."""

    rig: RigConfig
    buses: tuple[ZenohBus, ...]
    heard: set[str] = field(default_factory=set[str])
    asked: set[str] = field(default_factory=set[str])

    def attend(self) -> None:
        for bus in self.buses:
            bus.subscribe("**", lambda received: self.heard.add(received.topic))
            for name in SERVICES:
                bus.serve(name, partial(self._answer, name))

    def _answer(self, name: str, _: Message) -> Message:
        self.asked.add(name)
        return SERVICES[name].reply()

    def poll(self) -> None:
        for bus in self.buses:
            bus.poll(0.05)


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folders of keys: `good` as it is now, and one for each who has lost his rights or never had any."""
    folder, rig = tmp_path_factory.mktemp("keys"), rig_on(1, 2, 3)
    authority.new_authority(rig, folder / "good")
    shutil.copytree(folder / "good" / "camera", folder / "revoked camera")
    assert authority.revoke(rig, folder / "good", "camera") == "camera.2"
    authority.new_authority(rig, folder / "foreign")
    (folder / "foreign" / "station").rename(folder / "stranger")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(authority, "VALID_DAYS", -0.5)
        authority.new_authority(rig, folder / "old")
        shutil.copytree(folder / "good" / "authority", folder / "old" / "authority", dirs_exist_ok=True)
        shutil.rmtree(folder / "old" / "station")
        authority.issue(rig, folder / "old", "station", "station.1")
    (folder / "old" / "station").rename(folder / "expired station")
    return folder


@pytest.fixture
def agents(keys: Path, monkeypatch: pytest.MonkeyPatch) -> Generator[Agents]:
    rig = rig_on(free_port(), free_port(), free_port())
    monkeypatch.setenv("REPOSE_KEYS", str(keys / "good"))
    with contextlib.ExitStack() as stack:
        all_of_them = Agents(rig, tuple(stack.enter_context(ZenohBus.of(name, rig)) for name in SERVING))
        all_of_them.attend()
        yield all_of_them


def rights_of(who: str) -> tuple[set[str], set[str]]:
    """The topics that somebody may send and the services that he may ask."""
    if who in OUTSIDERS:
        return set(), set()
    sent = {f"{ANGLE_PREFIX}imu" if name == f"{ANGLE_PREFIX}*" else name for name in sent_by(who)}
    return sent, {name for name, service in SERVICES.items() if service.asker in (who, "any")}


@pytest.mark.parametrize("who", [*ROLES, *OUTSIDERS])
def test_each_is_heard_on_what_is_its_own_and_on_nothing_else(
    who: str, keys: Path, agents: Agents, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent, askable = rights_of(who)
    askable -= {name for name in askable if SERVICES[name].server == who}  # nobody hears another one of his own role
    at = tuple(endpoint for name in SERVING for endpoint in agents.rig.bus.endpoint(name))
    monkeypatch.setenv("REPOSE_KEYS", str(keys / who if who in OUTSIDERS else keys / "good" / who))
    with ZenohBus("rights", connect=at) as other:
        begin = time.monotonic()
        while (waited := time.monotonic() - begin) < PATIENCE_S:
            if waited > SETTLE_S and sent <= agents.heard and askable <= agents.asked:
                break
            for name in (*TOPICS, f"{ANGLE_PREFIX}imu"):
                other.publish(name, least(name))
            for name, service in SERVICES.items():
                other.request(name, service.request(), lambda _: None, timeout_s=0.3)
            agents.poll()
            other.poll(0.05)
    assert agents.heard == sent
    assert agents.asked == askable


def told_by(caplog: pytest.LogCaptureFixture) -> str:
    return "\n".join(record.getMessage() for record in caplog.records)


SAID = {
    "revoked camera": ("'camera.1', which counts as nobody", "were they revoked?"),
    "expired station": ("", "certificate has expired"),
    "stranger": ("", "No link with tls/127.0.0.1:"),
}
"""The words that are said where somebody is refused, and by whoever is refused."""


@pytest.mark.parametrize("who", SAID)
def test_who_is_refused_and_why_is_said_at_each_end_that_can_know(
    who: str, keys: Path, agents: Agents, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    here, there = SAID[who]
    monkeypatch.setattr(bus_watch, "PATIENCE_S", 2.0)
    monkeypatch.setenv("REPOSE_KEYS", str(keys / who))
    for bus, name in zip(agents.buses, SERVING, strict=True):
        bus.announce(name)
    with ZenohBus("rights", connect=agents.rig.bus.endpoint("arm")) as other:
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end and not (here in told_by(caplog) and there in told_by(caplog)):
            agents.poll()
            other.poll(0.05)
    assert here in told_by(caplog)
    assert there in told_by(caplog)


ACCEPTS = """
import sys, time
from shared.zenoh_bus import ZenohBus
with ZenohBus("rights", listen=[sys.argv[1]], process="arm") as bus:
    print("listening", flush=True)
    time.sleep(60)
"""


@pytest.mark.parametrize("who", ["expired station", "stranger"])
def test_a_handshake_that_failed_stands_in_the_log_of_the_end_that_refused_it(
    who: str, keys: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    endpoint = f"tls/127.0.0.1:{free_port()}"
    environment = {**os.environ, "REPOSE_KEYS": str(keys / "good"), "RUST_LOG": "zenoh_link_tls=warn"}
    words = [sys.executable, "-c", ACCEPTS, endpoint]
    with subprocess.Popen(words, env=environment, stdout=subprocess.PIPE, text=True) as accepting:
        assert accepting.stdout is not None
        assert "listening" in accepting.stdout.readline()
        monkeypatch.setenv("REPOSE_KEYS", str(keys / who))
        try:
            with ZenohBus("rights", connect=[endpoint]):
                assert "zenoh_link_tls" in accepting.stdout.readline()
        finally:
            accepting.kill()


def test_members_are_refused_nothing_in_the_log(
    agents: Agents, keys: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(bus_watch, "PATIENCE_S", 0.0)
    for bus, name in zip(agents.buses, SERVING, strict=True):
        bus.announce(name)
        bus.subscribe("log", lambda _: None)
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end and any(bus.alive() != frozenset(SERVING) for bus in agents.buses):
        time.sleep(0.05)
    for name in ("camera", "arm"):
        agents.buses[SERVING.index(name)].publish("log", least("log"))
    agents.poll()
    assert told_by(caplog) == ""


@pytest.mark.parametrize("who", ROLES)
def test_what_goes_beyond_ones_rights_is_said_by_ones_own_end(
    who: str, keys: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    sent, askable = rights_of(who)
    monkeypatch.setenv("REPOSE_KEYS", str(keys / "good" / who))
    with ZenohBus("rights", connect=("tls/127.0.0.1:9",)) as bus:
        for name in TOPICS:
            bus.publish(name, least(name))
        for name, service in SERVICES.items():
            bus.request(name, service.request(), lambda _: None, timeout_s=0.1)
    for name in TOPICS:
        assert (f"may not send {name}:" in told_by(caplog)) == (name not in sent)
    for name in SERVICES:
        assert (f"may not ask {name}:" in told_by(caplog)) == (name not in askable)


def test_a_camera_agent_cannot_stand_in_for_the_station(
    keys: Path, agents: Agents, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The certificate counts, not the name under which a process announces itself."""
    monkeypatch.setenv("REPOSE_KEYS", str(keys / "good" / "camera"))
    arm = agents.buses[1]
    with ZenohBus("rights", connect=agents.rig.bus.endpoint("arm"), process="station") as other:
        for name in ("station", "camera"):
            other.announce(name)
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end and "camera" not in arm.alive():
            agents.poll()
        other.request("arm/command", SERVICES["arm/command"].request(), lambda _: None, timeout_s=1.0)
        agents.poll()
        assert arm.alive() == {"camera"}
    assert "arm/command" not in agents.asked
