"""Connections without the key to a page's server: they are bounded, and leave room for whoever has the key."""

from __future__ import annotations

import http.client
import socket
from collections.abc import Generator, Iterator, Mapping
from contextlib import ExitStack, closing
from typing import Any

import pytest

from shared.page.access import HEADER
from shared.page.server import Handler, LoopbackServer
from shared.page.strangers import LONGEST_S, MOST, Strangers
from tests.serving import serving

TOKEN = "t" * 43


class _Page(Handler):
    package = "station.app.serve"
    command_line = "station serve"

    def look(self, path: str, query: Mapping[str, list[str]]) -> bool:
        """Has no parts."""
        del path, query
        return False

    def news(self) -> Iterator[tuple[str, Any]]:
        """Nothing is new."""
        return iter(())

    def act(self, name: str, asked: Mapping[str, Any]) -> None:
        """Does whatever is asked for."""


@pytest.fixture
def server() -> Generator[LoopbackServer]:
    with serving(LoopbackServer(_Page, port=0, token=TOKEN)) as made:
        yield made


@pytest.fixture
def pair() -> Generator[tuple[socket.socket, socket.socket]]:
    ours, theirs = socket.socketpair()
    with ours, theirs:
        theirs.settimeout(10)
        yield ours, theirs


def press(server: LoopbackServer, connection: http.client.HTTPConnection) -> int:
    """Presses the emergency stop; returns the answer's status, and leaves the connection open."""
    headers = {"Cookie": f"{server.access.cookie}={TOKEN}", HEADER: TOKEN}
    connection.request("POST", "/do/arm-stop", body="{}", headers=headers)
    with connection.getresponse() as answer:
        answer.read()
        return answer.status


def test_whoever_has_the_key_is_answered_beside_all_who_have_not(server: LoopbackServer) -> None:
    """A thousand silent connections took all files of the process, and the emergency stop had no answer."""
    address = ("127.0.0.1", server.server_port)
    with ExitStack() as stack:
        known, fresh = (stack.enter_context(closing(http.client.HTTPConnection(*address, timeout=10))) for _ in "12")
        assert press(server, known) == 200
        silent = [stack.enter_context(socket.create_connection(address, timeout=10)) for _ in range(MOST + 20)]
        assert press(server, fresh) == 200
        assert press(server, known) == 200, "it has shown the key and is nobody's room"
        assert [one.recv(1) for one in silent[:20]] == [b""] * 20, "the oldest have made room"
        assert len(server.strangers) <= MOST


def test_a_strangers_time_ends_however_much_it_sends(pair: tuple[socket.socket, socket.socket]) -> None:
    ours, theirs = pair
    strangers = Strangers()
    strangers.come(ours, 100.0)
    strangers.end_old(100.0 + LONGEST_S)
    assert len(strangers) == 1
    theirs.sendall(b"GET / HT")
    strangers.end_old(100.1 + LONGEST_S)
    assert len(strangers) == 0
    assert theirs.recv(1) == b""


def test_whoever_has_shown_the_key_has_all_the_time(pair: tuple[socket.socket, socket.socket]) -> None:
    ours, theirs = pair
    strangers = Strangers()
    strangers.come(ours, 100.0)
    strangers.go(ours)
    strangers.end_old(1e6)
    ours.sendall(b"x")
    assert theirs.recv(1) == b"x"
