"""A session's name, and its claim to the arm before it begins: one session at a time moves it."""

from __future__ import annotations

import os
import secrets
import socket
import time

from shared.bus import Bus
from shared.clock import Clock
from shared.errors import UserError
from shared.messages import ArmReply, LeaseRequest, Message

ANSWER_S = 5.0
"""The time in which the arm agent has to answer: milliseconds when it is there, and seconds while it starts."""


def session_name() -> str:
    """Returns a name that no other session has, and that says where to look for this one: computer, process, chance."""
    return f"{socket.gethostname()}/{os.getpid()}/{secrets.token_hex(4)}"


def claim_arm(bus: Bus, *, clock: Clock, owner: str, take_over: bool) -> None:
    """Waits until the arm agent has given the arm to this session.

    Raises:
        UserError: with the arm agent's reason, if another session has it, or if the agent does not answer.
    """
    replies: list[ArmReply] = []

    def on_reply(reply: Message | None) -> None:
        replies.extend([reply] if isinstance(reply, ArmReply) else [])

    end = time.monotonic() + ANSWER_S
    while not replies and time.monotonic() < end:
        bus.request("arm/lease", LeaseRequest(clock.now_ns(), owner, take_over), on_reply, timeout_s=1.0)
        bus.poll(1.0)
    if not replies:
        raise UserError(
            f"Expected the arm agent to give this session the arm within {ANSWER_S:g} s, it did not answer; "
            "is `station arm` running, and of this version?"
        )
    if not replies[0].accepted:
        raise UserError(replies[0].reason)
