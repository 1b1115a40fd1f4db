"""Asks a service of the bus until it answers: a link that has just been made may lose the first request."""

from __future__ import annotations

import threading
import time

from shared.bus import Bus
from shared.messages import Message

_AGAIN_S = 0.3
"""The time after which the request is repeated: an answer takes milliseconds on a link that stands."""


def asked(bus: Bus, service: str, request: Message, *, within_s: float) -> Message | None:
    """Returns the answer to a request; None if there is none within `within_s`. It may be called on any thread."""
    replies: list[Message] = []
    answered = threading.Event()

    def on_reply(reply: Message | None) -> None:
        if reply is not None:
            replies.append(reply)
            answered.set()

    end = time.monotonic() + within_s
    while not answered.is_set() and time.monotonic() < end:
        bus.request(service, request, on_reply, timeout_s=_AGAIN_S, direct=True)
        answered.wait(_AGAIN_S)
    return replies[0] if replies else None
