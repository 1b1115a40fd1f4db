"""The relay between Rerun's page and the browser: the page without links that lead away, under a policy."""

from __future__ import annotations

import gzip
import http.client
import threading
from collections.abc import Generator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

from station.view.relay import Relay

PAGE = b"""<link rel="icon" href="favicon.ico" />
<link rel="preconnect" href="https://fonts.googleapis.com" />
<link
  href="https://fonts.googleapis.com/css2"
  rel="stylesheet"
/><script src="re_viewer.js"></script>"""
PROGRAM = gzip.compress(b"a program " * 1000)
DATA_PORT = 4321


class Rerun(BaseHTTPRequestHandler):
    """Answers as Rerun's server does."""

    def log_message(self, format: str, *args: object) -> None: ...

    def do_GET(self) -> None:
        self.send_response(200)
        if self.path.startswith("/?"):
            kind, body = "text/html", PAGE
        else:
            kind, body = "application/wasm", PROGRAM
            self.send_header("Content-Encoding", "gzip")
            self.send_header("rerun-final-length", "10000")
        self.send_header("Content-Type", kind)
        self.end_headers()
        self.wfile.write(body)


@pytest.fixture
def relay() -> Generator[Relay]:
    upstream = ThreadingHTTPServer(("127.0.0.1", 0), Rerun)
    threading.Thread(target=upstream.serve_forever, args=(0.02,), daemon=True).start()
    made = Relay(upstream.server_port, data_port=DATA_PORT)
    yield made
    made.close()
    upstream.shutdown()
    upstream.server_close()


def asked(relay: Relay, path: str, host: str = "") -> tuple[int, dict[str, str], bytes]:
    """Status, headers and body of a request."""
    connection = http.client.HTTPConnection("127.0.0.1", relay.server_port, timeout=30)
    connection.request("GET", path, headers={"Host": host} if host else {})
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer.status, dict(answer.getheaders()), body


def test_the_page_has_no_link_that_leads_away_and_may_ask_this_computer_alone(relay: Relay) -> None:
    status, headers, body = asked(relay, "/?url=rerun")
    assert status == 200
    assert b"https://" not in body
    assert b'href="favicon.ico"' in body
    assert b"re_viewer.js" in body
    policy = headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert f"connect-src 'self' http://127.0.0.1:{DATA_PORT};" in policy
    assert "https:" not in policy


def test_a_program_is_handed_on_as_it_is(relay: Relay) -> None:
    status, headers, body = asked(relay, "/re_viewer_bg.wasm")
    assert (status, body) == (200, PROGRAM)
    assert (headers["Content-Encoding"], headers["rerun-final-length"]) == ("gzip", "10000")
    assert "Content-Security-Policy" in headers


def test_a_foreign_name_for_this_computer_is_refused(relay: Relay) -> None:
    assert asked(relay, "/?url=rerun", host="evil.example:80")[0] == 421


def test_a_viewer_that_has_ended_is_told(relay: Relay) -> None:
    relay.page_port = 1  # nobody listens there
    assert asked(relay, "/?url=rerun")[0] == 502
