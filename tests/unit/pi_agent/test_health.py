import socket
from pathlib import Path

import pytest

from pi_agent.health import ProcessorMeter, Watchdog, temperature_c


def received(path: Path) -> socket.socket:
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    listener.bind(str(path))
    listener.settimeout(2.0)
    return listener


def test_systemd_hears_of_frames_only_after_frames(tmp_path: Path):
    with received(tmp_path / "notify") as listener:
        watchdog = Watchdog({"NOTIFY_SOCKET": str(tmp_path / "notify"), "WATCHDOG_USEC": "10000000"})
        watchdog.ready()
        watchdog.say("two\nlines")
        for _ in range(5):
            watchdog.fresh_frame()  # five frames within a fifth of the limit: one pat
        watchdog.stopping()
        said = [listener.recv(100).decode() for _ in range(4)]
        assert said == ["READY=1", "STATUS=two lines", "WATCHDOG=1", "STOPPING=1"]
        listener.setblocking(False)
        with pytest.raises(BlockingIOError):
            listener.recv(100)


def test_an_abstract_socket_is_understood():
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind("\0repose-test-notify")
        listener.settimeout(2.0)
        Watchdog({"NOTIFY_SOCKET": "@repose-test-notify"}).ready()
        assert listener.recv(100) == b"READY=1"


def test_without_systemd_nothing_is_sent():
    watchdog = Watchdog({})
    watchdog.ready()
    watchdog.fresh_frame()


def test_a_gone_socket_does_no_harm(tmp_path: Path):
    Watchdog({"NOTIFY_SOCKET": str(tmp_path / "gone"), "WATCHDOG_USEC": "1000"}).fresh_frame()


def test_the_temperature_is_read_or_unknown(tmp_path: Path):
    (tmp_path / "temp").write_text("48312\n")
    assert temperature_c(tmp_path / "temp") == pytest.approx(48.312)
    assert temperature_c(tmp_path / "none") != temperature_c(tmp_path / "none")  # NaN


def test_processor_time_is_counted():
    meter = ProcessorMeter()
    sum(range(300_000))
    assert meter.percent() > 0
