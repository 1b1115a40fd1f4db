"""The page's server and what stands behind it, without a browser and without a rig."""

from __future__ import annotations

import http.client
import json
import math
import os
import threading
import time
from collections.abc import Generator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

from shared.bus import Received
from shared.clock import SimulatedClock
from shared.errors import UserError
from shared.memory_bus import MemoryBus
from shared.messages import (
    ArmReply,
    CameraGeometry,
    Heartbeat,
    Message,
    Sample,
    SessionPause,
    SessionReply,
    SessionRequest,
    SessionStatus,
)
from shared.page.access import HEADER, Access, is_local, token_of
from station.app import assembly
from station.app.control import SessionControl
from station.app.processes import StopRequest
from station.app.serve import sessions as sessions_module
from station.app.serve.backend import Backend
from station.app.serve.curve import friction_of
from station.app.serve.follower import Follower
from station.app.serve.jobs import KINDS, Program, words_of
from station.app.serve.server import PageServer
from station.app.serve.sessions import Files
from station.app.serve.shelf import Shelf
from station.recording.opening import open_file
from station.sampling.plan import Plan
from tests.serving import serving
from tests.unit.diagnosis.recorded import GOLDEN
from tests.unit.view import session

TOKEN = "t" * 43


@pytest.fixture
def bus() -> MemoryBus:
    return MemoryBus(SimulatedClock())


@pytest.fixture
def backend(bus: MemoryBus, tmp_path: Path) -> Generator[Backend]:
    (tmp_path / "recordings").mkdir()
    (tmp_path / "one.mcap").write_bytes(b"1234")
    (tmp_path / "one-diagnosis.html").write_text("<p>found</p>", encoding="utf-8")
    (tmp_path / "secret.html").write_text("no", encoding="utf-8")
    rig_file = assembly.simulated_rig_path()
    files = Files(rig=rig_file, plan=None, folder=tmp_path)
    made = Backend(bus, assembly.rig_from(None), files=files, clock=SimulatedClock())
    yield made
    made.close()


@pytest.fixture
def server(backend: Backend) -> Generator[PageServer]:
    with serving(PageServer(backend, port=0, token=TOKEN)) as made:
        yield made


def ask(
    server: PageServer,
    path: str,
    *,
    cookie: bool = True,
    host: str = "",
    body: Any = None,
    headers: Mapping[str, str] | None = None,
) -> tuple[int, dict[str, str], str]:
    """Status, headers and text of an answer; with a `body` it is a POST."""
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=10)
    told = dict(headers or {})
    told |= {"Cookie": f"{server.access.cookie}={TOKEN}"} if cookie else {}
    told |= {"Host": host} if host else {}
    text = None if body is None else body if isinstance(body, str) else json.dumps(body)
    connection.request("GET" if body is None else "POST", path, body=text, headers=told)
    answer = connection.getresponse()
    found = answer.status, dict(answer.getheaders()), answer.read().decode()
    connection.close()
    return found


# --- who is let in ---------------------------------------------------------------------------------------------------


def test_the_link_lets_in_and_takes_the_key_out_of_the_address(server: PageServer) -> None:
    path = server.url.partition(str(server.server_port))[2]
    status, headers, _ = ask(server, path, cookie=False)
    assert (status, headers["Location"]) == (303, "/")
    assert "HttpOnly" in headers["Set-Cookie"]
    assert "SameSite=Strict" in headers["Set-Cookie"]


@pytest.mark.parametrize("path", ["/", "/page.js", "/events", "/recordings", "/made/diagnosis/one.mcap", "/?token=x"])
def test_without_the_key_there_is_nothing(server: PageServer, path: str) -> None:
    status, _, text = ask(server, path, cookie=False)
    assert status == 403
    assert TOKEN not in text


@pytest.mark.parametrize("host", ["evil.example", "evil.example:8787", "127.0.0.1.evil.example", "10.0.0.7:8787", ""])
def test_a_name_that_only_resolves_to_this_machine_is_refused(host: str, server: PageServer) -> None:
    assert not is_local(host)
    if host:
        assert ask(server, "/", host=host)[0] == 421
        assert ask(server, "/do/arm-stop", host=host, body={}, headers={HEADER: TOKEN})[0] == 421


@pytest.mark.parametrize("host", ["127.0.0.1:8787", "localhost:1", "localhost", "[::1]:8787"])
def test_this_machines_own_names_are_taken_at_any_port(host: str) -> None:
    assert is_local(host)


@pytest.mark.parametrize(
    ("headers", "cookie"),
    [({}, True), ({HEADER: "x"}, True), ({HEADER: TOKEN}, False), ({HEADER: TOKEN, "Origin": "http://evil"}, True)],
)
def test_an_action_needs_cookie_header_and_our_own_page(
    server: PageServer, headers: dict[str, str], cookie: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    acted = list[str]()

    def act(name: str, _: object) -> None:
        acted.append(name)

    monkeypatch.setattr(server.backend, "act", act)
    assert ask(server, "/do/arm-stop", cookie=cookie, body={}, headers=headers)[0] == 403
    assert acted == []
    own = {HEADER: TOKEN, "Origin": f"http://127.0.0.1:{server.server_port}"}
    assert ask(server, "/do/arm-stop", body={}, headers=own)[0] == 200
    assert acted == ["arm-stop"]


def test_nothing_acts_by_being_looked_at(server: PageServer) -> None:
    assert ask(server, "/do/arm-stop", headers={HEADER: TOKEN})[0] == 404


def test_a_token_file_is_made_for_its_owner_alone_and_kept(tmp_path: Path) -> None:
    file = tmp_path / "key"
    first = token_of(file)
    assert token_of(file) == first
    assert token_of(None) != token_of(None)
    assert file.stat().st_mode & 0o077 == 0
    file.write_text("short", encoding="utf-8")
    with pytest.raises(UserError, match="delete the file"):
        token_of(file)


@pytest.mark.skipif(os.name == "nt", reason="Windows keeps rights by other means")
@pytest.mark.parametrize(
    ("folder_mode", "mode", "said"),
    [
        (0o700, 0o644, "key of a page that its owner alone can read, got .*kept/key: chmod 600 it"),
        (0o777, 0o600, "owner alone can write to, got .*kept: chmod go-w it"),
    ],
)
@pytest.mark.parametrize("linked", [False, True], ids=["file", "link"])
def test_a_token_that_others_know_or_choose_is_refused(
    tmp_path: Path, folder_mode: int, mode: int, said: str, *, linked: bool
) -> None:
    """Any user of the machine could read the key, or put one there that they know, and press the buttons."""
    file = tmp_path / "kept" / "key"
    file.parent.mkdir(mode=0o700)
    token_of(file)
    file.chmod(mode)
    file.parent.chmod(folder_mode)
    link = tmp_path / "link"
    link.symlink_to(file)
    with pytest.raises(UserError, match=said):
        token_of(link if linked else file)


@pytest.mark.skipif(os.name == "nt", reason="Windows keeps rights by other means")
def test_no_token_is_made_where_others_may_write(tmp_path: Path) -> None:
    tmp_path.chmod(0o777)
    with pytest.raises(UserError, match="chmod go-w it"):
        token_of(tmp_path / "key")
    assert not (tmp_path / "key").exists()


def test_the_cookies_of_two_servers_do_not_meet() -> None:
    one, other = Access(TOKEN, port=1), Access("o" * 43, port=2)
    both = {"Cookie": f"{one.cookie}={TOKEN}; {other.cookie}={'o' * 43}"}
    assert one.may_read(both)
    assert other.may_read(both)


# --- answers ---------------------------------------------------------------------------------------------------------


def test_the_page_allows_nothing_from_elsewhere(server: PageServer) -> None:
    status, headers, text = ask(server, "/")
    assert status == 200
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert TOKEN in text
    for part in (text, ask(server, "/page.js")[2], ask(server, "/page.css")[2]):
        assert "https://" not in part
        assert "http://" not in part.replace('"http://www.w3.org/2000/svg"', "")


def test_what_was_made_is_shown_without_scripts_and_nothing_else_is(server: PageServer) -> None:
    status, headers, text = ask(server, "/made/diagnosis/one.mcap")
    assert (status, text) == (200, "<p>found</p>")
    assert "sandbox" in headers["Content-Security-Policy"]
    for path in (
        "/made/report/one.mcap",
        "/made/diagnosis/../secret.html",
        "/made/diagnosis/secret",
        "/made/x/one.mcap",
    ):
        assert ask(server, path)[0] == 404


@pytest.mark.parametrize(
    ("path", "body", "status", "said"),
    [
        ("/do/nothing", {}, 409, "Expected one of session, arm-stop"),
        ("/do/session", {"action": "dance"}, 409, "Expected start, pause, resume, stop"),
        ("/do/session", {"action": "start", "samples": "9", "seed": 1}, 409, "whole number as 'samples'"),
        ("/do/session", {"action": "start", "samples": 0, "seed": 1}, 409, "1 to 100000 samples"),
        ("/do/job", {"kind": "doctor", "recording": "/etc/passwd"}, 409, "none called '/etc/passwd'"),
        ("/do/job", {"kind": "rm", "recording": "one.mcap"}, 409, "Expected one of doctor"),
        ("/do/session", "no json", 400, "JSON"),
        ("/do/session", [], 409, "JSON"),
        ("/do/session", "x" * 100_000, 400, "JSON"),
    ],
)
def test_a_wrong_request_is_refused_in_one_sentence(
    server: PageServer, path: str, body: Any, status: int, said: str
) -> None:
    found, _, text = ask(server, path, body=body, headers={HEADER: TOKEN})
    assert found == status
    assert said in text
    assert text.count("\n") == 1


def test_the_stream_tells_samples_and_state(server: PageServer, bus: MemoryBus) -> None:
    bus.publish("session/heartbeat", Heartbeat(1, armed=True, owner="me"))
    bus.publish("session/sample", replace(session.sample(), run=7, onset_angle_rad=math.radians(20.0)))
    bus.publish("session/sample", replace(session.sample(), run=8, onset_angle_rad=math.nan))
    bus.poll()
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=20)
    connection.request("GET", "/events", headers={"Cookie": f"{server.access.cookie}={TOKEN}"})
    stream = connection.getresponse()
    told = dict[str, Any]()
    while set(told) < {"samples", "state", "curve"}:
        event = stream.readline().decode().removeprefix("event: ").strip()
        told.setdefault(event, json.loads(stream.readline().decode().removeprefix("data: ")))
        stream.readline()
    assert [one["run"] for one in told["samples"]["samples"]] == [7, 8]
    assert told["samples"]["samples"][0]["onset_deg"] == pytest.approx(20.0)
    assert told["samples"]["samples"][1]["onset_deg"] is None
    assert told["state"]["done"] == 2
    assert told["state"]["rig"] == "simulated"
    assert "camera sags" in " ".join(told["state"]["notes"]), "what the rig conceals stands under its name"
    assert told["state"]["note_lines"][0].startswith("Note: the rig is a simulation")
    connection.close()


# --- the session -----------------------------------------------------------------------------------------------------


def test_another_session_begins_anew(bus: MemoryBus, tmp_path: Path) -> None:
    follower = Follower(bus, tmp_path)

    def give(topic: str, message: Message) -> None:
        follower.take(Received(topic, 1, message))

    give("session/sample", session.sample())  # messages that the bus kept arrive before the heartbeat
    give("session/heartbeat", Heartbeat(1, armed=True, owner="one"))
    assert len(follower.samples()[1]) == 1
    assert follower.state()["total"] is None
    give("session/status", SessionStatus(owner="one", recording="a.mcap", total=9, paused=True))
    assert (follower.state()["total"], follower.state()["recording"], follower.state()["paused"]) == (9, "a.mcap", True)
    give("session/heartbeat", Heartbeat(2, armed=True, owner="two"))
    assert follower.samples()[:2] == (2, [])
    assert follower.state()["paused"] is False


def test_a_session_that_is_started_begins_empty(
    bus: MemoryBus, backend: Backend, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Program, "begin", Mock())

    def give(topic: str, message: Message) -> None:
        backend.follower.take(Received(topic, 1, message))

    give("session/heartbeat", Heartbeat(1, armed=True, owner="one"))
    give("session/status", SessionStatus(owner="one", recording="a.mcap", total=1))
    give("session/sample", Sample(run=1))
    began = backend.follower.began
    backend.act("session", {"action": "start", "samples": 3, "seed": 4})
    assert backend.follower.samples()[:2] == (began + 1, [])
    state = backend.state()
    assert (state["done"], state["total"], state["ended"], state["recording"]) == (0, None, False, "")
    give("session/status", SessionStatus(owner="two", recording="b.mcap", total=3))
    give("session/heartbeat", Heartbeat(2, armed=True, owner="two"))
    assert (backend.follower.began, backend.state()["total"]) == (began + 1, 3)


def test_the_state_says_that_the_session_has_ended_and_raises_no_alarm(
    bus: MemoryBus, backend: Backend, monkeypatch: pytest.MonkeyPatch
) -> None:
    bus.announce("station")
    backend.follower.take(Received("session/status", 1, SessionStatus(recording="a.mcap")))
    running = backend.state()
    assert (running["running"], running["ended"]) == (True, False)
    assert {part["part"] for part in running["health"] if not part["well"]} == {"camera", "arm", "clock"}
    monkeypatch.setattr(bus, "alive", frozenset)
    ended = backend.state()
    assert (ended["running"], ended["ended"]) == (False, True)
    assert all(part["well"] for part in ended["health"])
    assert {part["part"] for part in ended["health"] if part["off"]} == {"camera", "arm", "clock"}


def test_the_session_does_what_is_asked_and_refuses_the_rest(bus: MemoryBus) -> None:
    stop, heard, replies = StopRequest(), list[Message](), list[Message | None]()
    control = SessionControl(bus, Plan(samples=5), stop=stop, owner="me", recording="a.mcap")
    for topic in ("session/pause", "session/status"):
        bus.subscribe(topic, lambda received: heard.append(received.message))

    def request(action: str) -> SessionReply:
        bus.request("session/control", SessionRequest(1, action), replies.append)
        bus.poll()
        bus.poll()
        reply = replies[-1]
        assert isinstance(reply, SessionReply)
        return reply

    control.tick(10, samples=1)
    assert request("pause").accepted
    control.tick(20, samples=1)
    assert request("resume").accepted
    bus.poll()
    assert [one.paused for one in heard if isinstance(one, SessionPause)] == [True, False]
    assert [one.paused for one in heard if isinstance(one, SessionStatus)] == [False, True]
    assert "got 'dance'" in request("dance").reason
    assert stop.reason == ""
    assert request("stop").accepted
    assert request("stop").accepted
    assert (stop.reason.startswith("stopped by"), stop.times) == (True, 1), "twice would leave the plate tilted"


def test_the_emergency_stop_reaches_the_arm_agent_and_says_when_it_does_not(
    backend: Backend, bus: MemoryBus, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sessions_module, "_STOP_S", 0.1)
    with pytest.raises(UserError, match="press the red button"):
        backend.act("arm-stop", {})
    reasons = list[str]()

    def serve(message: Any) -> ArmReply:
        reasons.append(message.reason)
        return ArmReply(accepted=True)

    bus.serve("arm/stop", serve, direct=True)
    backend.act("arm-stop", {})
    assert reasons == ["emergency stop on the page"]


def test_a_pause_without_a_session_is_refused(backend: Backend, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sessions_module, "_CONTROL_S", 0.1)
    with pytest.raises(UserError, match="no session answers"):
        backend.act("session", {"action": "pause"})


def test_start_begins_the_command_that_the_rig_needs_and_only_one(
    backend: Backend, bus: MemoryBus, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun = list[list[str]]()

    def begin(program: Program) -> None:
        begun.append(program.words)

    monkeypatch.setattr(Program, "begin", begin)
    backend.act("session", {"action": "start", "samples": 3, "seed": 4})
    assert begun[0][0] == "rig"
    assert begun[0][3:7] == ["--samples", "3", "--seed", "4"]
    bus.announce("arm")
    backend.act("session", {"action": "start", "samples": 3, "seed": 4})
    assert begun[1][0] == "run"
    bus.announce("station")
    with pytest.raises(UserError, match="one runs"):
        backend.act("session", {"action": "start", "samples": 3, "seed": 4})


# --- recordings ------------------------------------------------------------------------------------------------------


def test_the_list_has_recordings_and_what_was_made_of_them(tmp_path: Path, backend: Backend) -> None:
    (tmp_path / "recordings" / "two.mcap").write_bytes(b"")
    (tmp_path / "recordings" / "three.mcap.partial").write_bytes(b"")
    listed = {one["name"]: one["pages"] for one in backend.shelf.listed()}
    assert listed == {"one.mcap": ["diagnosis"], "recordings/two.mcap": []}


def test_a_recording_is_listed_with_its_own_start_and_not_with_that_of_its_file(tmp_path: Path) -> None:
    copied, damaged = tmp_path / "copied.mcap", tmp_path / "damaged.mcap"
    copied.write_bytes(GOLDEN.read_bytes())
    damaged.write_bytes(b"1234")
    listed = {one["name"]: one for one in Shelf(tmp_path).listed()}
    assert listed["copied.mcap"]["started_s"] == pytest.approx(1e-9 * open_file(GOLDEN).start_ns)
    assert listed["copied.mcap"]["mode"] == "lockstep"
    assert listed["damaged.mcap"]["started_s"] is None


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_of_work_is_a_command_that_its_parser_takes(kind: str, tmp_path: Path) -> None:
    import argparse  # noqa: PLC0415
    import importlib  # noqa: PLC0415

    from station.__main__ import commands  # noqa: PLC0415

    name, *words = words_of(kind, tmp_path / "a.mcap", Shelf(tmp_path))
    parser = argparse.ArgumentParser()
    importlib.import_module(f"station.app.commands.{commands()[name].stem}").add_arguments(parser)
    parser.parse_args(words)


def test_work_tells_its_output_and_its_end(backend: Backend) -> None:
    backend.act("job", {"kind": "doctor", "recording": "one.mcap"})
    with pytest.raises(UserError, match="one command at a time"):
        backend.act("job", {"kind": "report", "recording": "one.mcap"})
    program = backend.jobs.newest
    assert program is not None
    assert program.process is not None
    assert program.process.wait(60) == 2
    for thread in threading.enumerate():
        if thread.name == "output":
            thread.join(10)
    told = backend.state()["job"]
    assert (told["running"], told["status"], told["page"]) == (False, 2, False)
    assert "one.mcap" in told["lines"][-1]


# --- the curve -------------------------------------------------------------------------------------------------------


def test_without_samples_there_is_no_curve() -> None:
    assert friction_of([], None, fitted=True)["note"] == "no samples yet"
    assert friction_of([Sample(flags=("disturbed_cut",))], None, fitted=True)["points"] == []


def test_few_samples_are_points_and_a_sentence_why_there_is_no_curve() -> None:
    told = friction_of([session.sample()], session.GEOMETRY, fitted=True)
    assert told["curve"] == []
    assert "No limit curve can be fitted" in told["note"]
    json.dumps(told, allow_nan=False)


def test_samples_that_make_no_sense_end_neither_the_page_nor_its_curve(backend: Backend, bus: MemoryBus) -> None:
    bus.publish("camera/geometry", CameraGeometry())
    bus.publish("session/sample", replace(session.sample(), direction=9, reference_corners_px=(), euler_rad=()))
    bus.publish("session/status", SessionStatus(slip_corners=99, total=-3, slip_base_px=math.nan, recording="../../x"))
    assert backend.state()["done"] == 1
    end = time.monotonic() + 20
    while backend.curve.version < 2 and time.monotonic() < end:
        time.sleep(0.05)
    assert backend.curve.version >= 2
    assert backend.curve.state["note"]
