"""Draws the pictures of the page of `station serve`, as its README shows them: a session of the simulated rig on it.

`python -m tests.system.page_pictures FOLDER` takes seven minutes on an idle machine. The camera of a busy one drops
frames, which the pictures would tell.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from tests.system import chromium
from tests.system.ports import free_port
from tests.system.processes import end, start
from tests.system.test_page import link_of

SAMPLES, FROM = 36, 30
"""The samples of the session, and the first run that is shown: enough for a limit curve, and some still to come."""
STATE = "document.getElementById('state').innerText"
SHOWN = f"document.querySelector('#curve .fit') && /^run {FROM // 10}.: tilting$/.test({STATE})"


def main(folder: Path) -> None:
    """Writes page.png, as wide as a laptop shows it, and phone.png into a folder, which need not be there."""
    folder.mkdir(parents=True, exist_ok=True)
    with (
        tempfile.TemporaryDirectory() as recordings,
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile,  # the browser still writes as it ends
        chromium.browser(Path(profile)) as page,
    ):
        process = start("station", "serve", recordings, "--port", str(free_port()), "--no-browser")
        try:
            page.size(1000, 670)
            page.open(link_of(process))
            begin(page)
            page.picture(folder / "page.png")
            page.size(390, 760, phone=True)
            page.picture(folder / "phone.png")
        finally:
            end(process)


def begin(page: chromium.Page) -> None:
    """Starts a session on the page, and waits until a run tilts that is to be shown."""
    page.of(f"document.getElementById('samples').value = {SAMPLES}")
    page.click("#start")
    for run in range(1, FROM):
        page.wait(f"{STATE}.startsWith('run {run}:')")
    page.wait(SHOWN)
    page.of("window.scrollTo(0, 0)")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
