"""A virtual live camera: pictures as a motion-JPEG stream over HTTP on the loopback, at their own pace."""

from __future__ import annotations

import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import cv2
import numpy as np


class StreamCamera:
    """Serves pictures whose grey level is their number, until it is told to stop."""

    def __init__(self, *, rate_hz: float = 60.0, size: tuple[int, int] = (600, 600)) -> None:
        self.unplugged = threading.Event()
        stream = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                self.send_response(200)
                self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
                self.end_headers()
                stream.play(self.wfile, rate_hz, size)

            def log_message(self, format: str, *args: Any) -> None:
                pass

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self._server.server_port}/camera.mjpg"

    def __enter__(self) -> StreamCamera:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.unplugged.set()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def play(self, out: Any, rate_hz: float, size: tuple[int, int]) -> None:
        start, number = time.monotonic(), 0
        while not self.unplugged.is_set():
            picture = np.full((size[1], size[0]), number % 200, dtype=np.uint8)
            data = cv2.imencode(".jpg", picture)[1].tobytes()
            head = f"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {len(data)}\r\n\r\n"
            try:
                out.write(head.encode() + data + b"\r\n")
                out.flush()
            except OSError:
                return  # nobody looks any more
            number += 1
            time.sleep(max(start + number / rate_hz - time.monotonic(), 0.0))
