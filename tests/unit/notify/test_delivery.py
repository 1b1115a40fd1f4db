"""Notifications arrive; and where they do not, that is one sentence, shows no address and has held nobody up."""

from __future__ import annotations

import json
import socket
import sys
from pathlib import Path

import pytest

from shared.notify import NotifyConfig
from station.app.notify.notifier import CAPACITY, Notifier
from tests.unit.notify.receiver import SECRET, receiver

WRITES = "import pathlib, sys; pathlib.Path(sys.argv[1]).write_text(sys.stdin.read() + sys.argv[2], encoding='utf-8')"


def notifier(now_s: float = 0.0, **settings: object) -> Notifier:
    return Notifier(NotifyConfig(**{"timeout_s": 0.2, **settings}), seconds=lambda: now_s)  # pyright: ignore[reportArgumentType]


def test_a_url_gets_json_by_post():
    with receiver() as got:
        one = notifier(url=got.url.replace("http://", "http://ann:pass@"))
        one.tell("fault", "Rig lab: run 3 failed", time_ns=1_700_000_000_000_000_000, run=3)
        one.close()
    assert got.came == [
        {"event": "fault", "text": "Rig lab: run 3 failed", "time": "2023-11-14T22:13:20+00:00", "run": 3}
    ]
    assert got.headers[0]["Content-Type"] == "application/json"
    assert got.headers[0]["Authorization"] == "Basic YW5uOnBhc3M="
    assert list(one.failures()) == []


def test_a_command_gets_it_on_its_input_and_no_shell_sees_it(tmp_path: Path):
    out, text = tmp_path / "out", 'Rig lab: $(touch x); "quoted" & more'
    one = notifier(command=(sys.executable, "-S", "-c", WRITES, str(out), "{text}"), timeout_s=20.0)
    one.tell("mark", text, time_ns=0)
    one.close()
    assert list(one.failures()) == []
    body, end = json.JSONDecoder().raw_decode(out.read_text(encoding="utf-8"))
    assert (body["event"], body["text"]) == ("mark", text)
    assert out.read_text(encoding="utf-8")[end:] == text


@pytest.mark.parametrize(("status", "said"), [(500, "answered with status 500"), (302, "answered with status 302")])
def test_a_receiver_that_refuses_or_sends_elsewhere_is_reported(status: int, said: str):
    with receiver(status) as got:
        one = notifier(url=got.url)
        one.tell("end", "over", time_ns=0)
        one.close()
    (failure,) = one.failures()
    assert said in failure
    assert SECRET not in failure
    assert len(got.came) == 1, "nobody was called elsewhere"


def test_a_receiver_that_is_not_there_is_reported():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))  # bound and not listening: whoever connects is refused
        one = notifier(url=f"http://127.0.0.1:{taken.getsockname()[1]}/{SECRET}")
        one.tell("end", "over", time_ns=0)
        one.close()
    (failure,) = one.failures()
    assert "cannot be reached: " in failure
    assert SECRET not in failure


def test_a_receiver_that_hangs_holds_nobody_up():
    """While it hangs, telling returns; what finds no room is said; and closing does not wait for it for ever."""
    with receiver(hangs=True) as got:
        one = notifier(url=got.url, quiet_s=0.0)
        one.tell("fault", "first", time_ns=0)
        assert got.asked.wait(10)
        for _ in range(CAPACITY + 1):
            one.tell("fault", "further", time_ns=0)
        assert f"{CAPACITY} notifications wait already" in next(one.failures())
        one.close()
        assert any("hang" in failure for failure in one.failures())
        assert not got.held.is_set()


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (("no-such-program-anywhere", SECRET), "cannot be started: "),
        ((sys.executable, "-S", "-c", "raise SystemExit(3)", SECRET), "ended with status 3"),
        ((sys.executable, "-S", "-c", "import time; time.sleep(60)", SECRET), "did not end within 0.5 s"),
    ],
)
def test_a_command_that_fails_is_reported(command: tuple[str, ...], said: str):
    one = notifier(command=command, timeout_s=20.0 if "status" in said else 0.5)
    one.tell("end", "over", time_ns=0)
    one.close()
    (failure,) = one.failures()
    assert said in failure
    assert SECRET not in failure


def test_one_kind_is_told_once_in_a_while_and_the_rest_counted():
    now = [0.0]
    with receiver() as got:
        one = Notifier(NotifyConfig(url=got.url, on=("fault", "end")), seconds=lambda: now[0])
        one.tell("fault", "first", time_ns=0)
        one.tell("fault", "second", time_ns=0)
        one.tell("mark", "nobody asked", time_ns=0)
        now[0] = 601.0
        one.tell("fault", "third", time_ns=0)
        one.close()
    assert [body["text"] for body in got.came] == ["first", "third (1 more of this kind since the last one)"]
