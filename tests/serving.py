"""A server of a page that answers while a test asks it."""

from __future__ import annotations

import threading
from collections.abc import Generator
from contextlib import contextmanager
from typing import TypeVar

from shared.page.server import LoopbackServer

Server = TypeVar("Server", bound=LoopbackServer)


@contextmanager
def serving(server: Server) -> Generator[Server]:
    """Lets a server answer on a thread of its own, and closes it at the end."""
    thread = threading.Thread(target=server.serve_forever, args=(0.02,))
    thread.start()
    yield server
    server.close()
    thread.join(10)
