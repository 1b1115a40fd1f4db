"""The page of a backend without a rig, served on loopback and open in a real browser."""

from __future__ import annotations

import threading
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from station.app.serve.backend import Backend
from station.app.serve.server import PageServer
from tests.system import chromium


@contextmanager
def opened(backend: Backend, folder: Path) -> Generator[chromium.Page]:
    """Gives the page once it has loaded, with the browser's profile in the folder; closes the backend in the end."""
    server = PageServer(backend, port=0, token="t" * 43)
    thread = threading.Thread(target=server.serve_forever, args=(0.02,))
    thread.start()
    with chromium.browser(folder / "profile") as page:
        page.open(server.url)
        yield page
    server.close()
    thread.join(10)
    backend.close()
