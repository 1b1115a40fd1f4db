"""A real browser without a window, driven by its own protocol over a pipe: Chromium, where it is installed.

https://chromedevtools.github.io/devtools-protocol/; a message is JSON and ends with a zero byte.
"""

from __future__ import annotations

import base64
import contextlib
import json
import os
import select
import shutil
import subprocess
import sys
import time
from collections.abc import Generator
from pathlib import Path
from typing import Any

from tests.patience import PATIENCE_S

NAMES = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
WHY_NOT = "no Chromium (on Debian: apt-get install chromium-headless-shell), or no pipes for it on this system"
DRAWS_WITHOUT_A_CARD = ("--enable-unsafe-swiftshader", "--use-angle=swiftshader")
"""Words with which it draws what needs a graphics card, slowly, on a machine without one."""
_FIRST_FREE = 10
"""Numbers of files from here on are neither standard streams nor the two that the browser reads and writes."""

_NICE = 3
"""A niceness of 3 of 19 gives half of an ordinary process's share; with 10 a page beside four busy programs on two
processors did not answer within 150 s."""
_DROP_FROM_BOUNDING_SET, _CAP_SYS_NICE = 24, 23
"""Numbers of Linux: prctl(2) and capabilities(7)."""


def binary() -> str:
    """Its path; empty where there is none, or none that can be driven."""
    found = (shutil.which(name) for name in NAMES)
    return "" if sys.platform == "win32" else next((path for path in found if path), "")


class Page:
    """One page of the browser."""

    def __init__(self, process: subprocess.Popen[bytes], writing: int, reading: int) -> None:
        self._process, self._writing, self._reading = process, writing, reading
        self._number, self._rest = 0, b""
        self.errors: list[str] = []
        """The errors that the page's scripts threw, or that its console told."""
        target = self._ask("Target.createTarget", {"url": "about:blank"})["targetId"]
        self._session = self._ask("Target.attachToTarget", {"targetId": target, "flatten": True})["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self._ask(f"{domain}.enable")

    def _ask(self, method: str, parameters: dict[str, Any] | None = None) -> dict[str, Any]:
        self._number += 1
        asked: dict[str, Any] = {"id": self._number, "method": method, "params": parameters or {}}
        if hasattr(self, "_session"):
            asked["sessionId"] = self._session
        os.write(self._writing, json.dumps(asked).encode() + b"\0")
        end = time.monotonic() + PATIENCE_S
        while message := self._next(end):
            if message.get("id") == self._number:
                assert "error" not in message, f"{method}: {message['error']}"
                return message["result"]
            self._notice(message)
        raise AssertionError(f"{method} was not answered within {PATIENCE_S:g} s")

    def _next(self, end: float) -> dict[str, Any]:
        """Returns the next message; nothing where none comes until then (s on the monotonic clock)."""
        while b"\0" not in self._rest:
            if not select.select([self._reading], [], [], max(end - time.monotonic(), 0.0))[0]:
                return {}
            got = os.read(self._reading, 1 << 16)
            assert got, f"the browser ended with status {self._process.poll()}"
            self._rest += got
        line, _, self._rest = self._rest.partition(b"\0")
        return json.loads(line)

    def _notice(self, message: dict[str, Any]) -> None:
        told = message.get("params", {})
        if message.get("method") == "Runtime.exceptionThrown":
            self.errors.append(str(told["exceptionDetails"]))
        elif message.get("method") == "Log.entryAdded" and told["entry"]["level"] == "error":
            self.errors.append(f"{told['entry']['text']} {told['entry'].get('url', '')}")

    def open(self, url: str) -> None:
        """Goes to an address."""
        self._ask("Page.navigate", {"url": url})
        self.wait("document.readyState === 'complete'")

    def of(self, expression: str) -> Any:
        """The value of an expression in the page."""
        asked = {"expression": expression, "returnByValue": True, "awaitPromise": True}
        found = self._ask("Runtime.evaluate", asked)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def text(self, selector: str) -> str:
        """Returns what an element shows."""
        return str(self.of(f"document.querySelector({json.dumps(selector)})?.innerText ?? ''"))

    def click(self, selector: str) -> None:
        """Clicks on an element, which must be enabled and in no other's shadow."""
        name = json.dumps(selector)
        assert self.of(f"!document.querySelector({name}).disabled"), f"{selector} cannot be clicked"
        self.of(f"document.querySelector({name}).scrollIntoView({{block: 'center'}})")
        box = self.of(f"JSON.stringify(document.querySelector({name}).getBoundingClientRect())")
        at = json.loads(box)
        place = {"x": at["x"] + at["width"] / 2, "y": at["y"] + at["height"] / 2, "button": "left", "clickCount": 1}
        for kind in ("mousePressed", "mouseReleased"):
            self._ask("Input.dispatchMouseEvent", {"type": kind, **place})

    def wait(self, expression: str) -> None:
        """Until an expression holds."""
        end = time.monotonic() + PATIENCE_S
        while not self.of(f"Boolean({expression})"):
            assert time.monotonic() < end, f"waited {PATIENCE_S:g} s in vain for {expression}; {self.text('main')}"
            time.sleep(0.1)

    def size(self, width: int, height: int, *, phone: bool = False, dark: bool = False) -> None:
        """Shows the page as on a screen of that size."""
        self._ask(
            "Emulation.setDeviceMetricsOverride",
            {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": phone},
        )
        feature = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self._ask("Emulation.setEmulatedMedia", {"features": [feature]})

    def picture(self, path: Path, *, whole: bool = False) -> None:
        """Writes what it looks like as a PNG; `whole` also what one would have to scroll to."""
        asked = {"captureBeyondViewport": whole, "format": "png"}
        data = self._ask("Page.captureScreenshot", asked)["data"]
        path.write_bytes(base64.b64decode(data))


@contextlib.contextmanager
def browser(folder: Path, *more: str) -> Generator[Page]:
    """A browser with a profile of its own in the folder, and an empty page."""
    import fcntl  # noqa: PLC0415  # not on Windows

    theirs, writing = os.pipe()
    reading, answers = os.pipe()
    high = [fcntl.fcntl(each, fcntl.F_DUPFD, _FIRST_FREE) for each in (theirs, answers)]
    words = [binary(), "--headless", "--remote-debugging-pipe", f"--user-data-dir={folder}", "--no-first-run"]
    # A container has no namespaces for its sandbox; the pages are our own.
    words += ["--no-sandbox", "--disable-dev-shm-usage", "--disable-background-networking", *more, "about:blank"]
    # Where it draws without a card it would take a core from the rig that it shows, for as long as it runs. As root it
    # would even give its drawing process a niceness of -8, which starves the rig and its own page: it loses that right.
    begin = "import ctypes, os, sys; "
    begin += f"sys.platform == 'linux' and ctypes.CDLL(None).prctl({_DROP_FROM_BOUNDING_SET}, {_CAP_SYS_NICE}); "
    begin += f"os.nice({_NICE}); os.dup2({high[0]}, 3); os.dup2({high[1]}, 4); os.execv(sys.argv[1], sys.argv[1:])"
    python = [sys.executable, "-c", begin, *words]
    process = subprocess.Popen(python, pass_fds=high, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    for each in (theirs, answers, *high):
        os.close(each)
    try:
        yield Page(process, writing, reading)
    finally:
        process.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(10)
        process.kill()
        process.wait()
        os.close(writing)
        os.close(reading)
