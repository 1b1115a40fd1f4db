"""The server of a page: whatever is sent to it gets an answer in a sentence, and nothing ends in a traceback."""

from __future__ import annotations

import logging
import socket
import struct
from collections.abc import Generator, Iterator, Mapping
from typing import Any

import pytest

from shared.errors import UserError
from shared.page.access import HEADER
from shared.page.asked import number
from shared.page.server import Handler, LoopbackServer
from tests.serving import serving

TOKEN = "t" * 43


class _Page(Handler):
    package = "station.app.serve"
    command_line = "station serve"

    def look(self, path: str, query: Mapping[str, list[str]]) -> bool:
        """A part that cannot be made, and one whose browser has gone away meanwhile."""
        del query
        if path == "/broken":
            raise KeyError("no such thing")
        if path == "/gone":
            raise ConnectionResetError(104, "Connection reset by peer")
        return False

    def news(self) -> Iterator[tuple[str, Any]]:
        """Nothing is new."""
        return iter(())

    def act(self, name: str, asked: Mapping[str, Any]) -> None:
        """Refuses with what was asked for."""
        raise UserError(f"Expected another name than {name}, got {asked.get('name')}")


@pytest.fixture
def server() -> Generator[LoopbackServer]:
    with serving(LoopbackServer(_Page, port=0, token=TOKEN)) as made:
        yield made


def answer(server: LoopbackServer, head: bytes, body: bytes = b"", *, key: bool = True) -> bytes:
    """Returns the answer to the bytes of a request."""
    lines = [head, f"Host: 127.0.0.1:{server.server_port}".encode(), b"Connection: close"]
    if key:
        lines += [f"Cookie: {server.access.cookie}={TOKEN}".encode(), f"{HEADER}: {TOKEN}".encode()]
    if not any(b"Content-Length" in line for line in lines):
        lines.append(b"Content-Length: %d" % len(body))
    with socket.create_connection(("127.0.0.1", server.server_port), timeout=10) as connection:
        connection.sendall(b"\r\n".join([*lines, b"", body]))
        connection.shutdown(socket.SHUT_WR)
        return b"".join(iter(lambda: connection.recv(4096), b""))


@pytest.mark.parametrize("length", [b"\xb2", b"-1", b"65537", b"9" * 5000, b"1_0", b"0x10", b" "], ids=len)
def test_a_length_that_is_none_is_answered_without_the_key(
    server: LoopbackServer, length: bytes, capfd: pytest.CaptureFixture[str]
) -> None:
    """A superscript two is a digit to Python, and no number: there was no answer, and a traceback."""
    assert b" 403 " in answer(server, b"POST /do/x HTTP/1.1\r\nContent-Length: " + length, key=False)
    assert capfd.readouterr().err == ""


BODIES = {
    "deep lists": b"[" * 60_000,
    "deep objects": b'{"a":' * 12_000,
    "a long number": b"9" * 60_000,
    "no letters": b"\xff\xfe",
    "nothing": b"",
    "half an object": b'{"a": 1',
}


@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)
def test_a_body_that_is_no_object_is_answered(
    server: LoopbackServer, body: bytes, capfd: pytest.CaptureFixture[str]
) -> None:
    found = answer(server, b"POST /do/x HTTP/1.1", body)
    assert b" 400 " in found
    assert found.endswith(b"Expected a JSON object\n")
    assert capfd.readouterr().err == ""


def test_letters_that_are_half_a_character_are_answered(server: LoopbackServer) -> None:
    assert b" 409 " in answer(server, b"POST /do/x HTTP/1.1", rb'{"name": "\ud800"}')


@pytest.mark.parametrize("path", [b"http://[::1", b"http://[x]y/"])
def test_a_path_that_is_none_is_answered(
    server: LoopbackServer, path: bytes, capfd: pytest.CaptureFixture[str]
) -> None:
    assert b" 400 " in answer(server, b"GET " + path + b" HTTP/1.1", key=False)
    assert capfd.readouterr().err == ""


def test_a_mistake_of_ours_is_one_line(
    server: LoopbackServer, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    with caplog.at_level(logging.ERROR):
        assert answer(server, b"GET /broken HTTP/1.1") == b""
    (line,) = caplog.messages
    assert "KeyError: 'no such thing'" in line
    assert "Traceback" not in capfd.readouterr().err


def test_a_browser_that_goes_away_is_no_mistake(
    server: LoopbackServer, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    answer(server, b"GET /gone HTTP/1.1")
    with socket.create_connection(("127.0.0.1", server.server_port), timeout=10) as connection:
        connection.sendall(b"GET / HT")
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # a reset, not an end
    assert b" 403 " in answer(server, b"GET / HTTP/1.1", key=False)
    assert caplog.messages == []
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("value", [10**400, -(10**400), float("inf"), float("nan"), True, "1", None], ids=type)
def test_a_number_is_one_that_a_float_holds(value: object) -> None:
    with pytest.raises(UserError, match="Expected a number as 'exposure_ms'"):
        number({"exposure_ms": value}, "exposure_ms")
