"""Messages that may wait are sent on a thread of their own."""

from __future__ import annotations

import logging
import threading

import pytest

from shared.outbox import Outbox


def test_who_puts_does_not_wait_and_the_order_stays() -> None:
    """The first job waits for a link; the others come after it, in their order."""
    link, done = threading.Event(), list[int]()
    outbox = Outbox()
    outbox.put(lambda: done.append(int(link.wait(30.0))))
    for number in (2, 3, 4):
        outbox.put(lambda number=number: done.append(number))
    assert done == []
    link.set()
    outbox.close(within_s=30.0)
    assert done == [1, 2, 3, 4]


def test_a_job_that_fails_keeps_nobody_else_back(caplog: pytest.LogCaptureFixture) -> None:
    """It is logged, and the next is done."""
    done = list[int]()
    outbox = Outbox()
    with caplog.at_level(logging.ERROR):
        outbox.put(lambda: done.remove(7))
        outbox.put(lambda: done.append(1))
        outbox.close(within_s=30.0)
    assert done == [1]
    assert "could not be sent" in caplog.text


def test_closing_does_not_wait_for_ever() -> None:
    """A link that never takes anything is left behind."""
    link, done = threading.Event(), list[bool]()
    outbox = Outbox()
    outbox.put(lambda: done.append(link.wait(30.0)))
    outbox.close(within_s=0.05)
    assert done == []
    link.set()
