"""Progress in a log or a pipe."""

from __future__ import annotations

import io
import threading
import time

from rich.console import Console

from station.app.progress import EVERY_S, ProgressLines, looked_at, passed_text, stages


def test_without_a_terminal_a_line_now_and_then_says_how_long_it_takes() -> None:
    now = [0.0]
    out = io.StringIO()
    lines = ProgressLines(Console(file=out, width=60), total=100, seconds=lambda: now[0])
    lines.at(10)
    assert out.getvalue() == ""
    now[0] = 2 * EVERY_S
    lines.at(25)
    lines.at(26)
    assert out.getvalue() == "25 of 100 samples in 20 s, about 60 s left\n"
    now[0] = 240.0
    lines.at(50)
    assert out.getvalue().endswith("50 of 100 samples in 4 min, about 4 min left\n")
    drawn = io.StringIO()
    shown = ProgressLines(Console(file=drawn, force_terminal=True), total=100, seconds=lambda: now[0])
    now[0] = 10 * EVERY_S
    shown.at(50)
    assert drawn.getvalue() == ""


def test_without_a_terminal_the_stage_of_long_work_is_told_now_and_then() -> None:
    now, out = [0.0], io.StringIO()
    with stages(Console(file=out, width=60), "reading", seconds=lambda: now[0], every_s=0.001) as show:
        now[0] = EVERY_S
        await_line(out, "reading, 10 s so far\n")
        show("a long stage that says nothing itself")
        await_line(out, "a long stage that says nothing itself, 10 s so far\n")
    assert no_thread_is_left()
    with stages(Console(file=out, width=60), "in time"):
        pass
    assert "in time" not in out.getvalue()
    drawn = io.StringIO()
    with stages(Console(file=drawn, force_terminal=True), "reading", every_s=0.001):
        assert no_thread_is_left()
    assert "so far" not in drawn.getvalue()


def await_line(out: io.StringIO, line: str) -> None:
    end = time.monotonic() + 30.0
    while line not in out.getvalue():
        assert time.monotonic() < end, out.getvalue()
        time.sleep(0.001)


def no_thread_is_left() -> bool:
    return not any(thread.name == "progress" for thread in threading.enumerate())


def test_two_lines_of_one_stage_tell_two_times() -> None:
    """A stage that takes some minutes was told in whole ones: line after line was the same."""
    assert [passed_text(seconds) for seconds in (7.2, 119.4, 120.0, 129.6, 3601.0)] == [
        "7 s", "119 s", "2 min", "2 min 10 s", "60 min 1 s",
    ]  # fmt: skip


def test_one_looks_on_while_others_work_and_at_the_end() -> None:
    looks, thrice = list[int](), threading.Event()

    def look() -> None:
        looks.append(len(looks))
        if len(looks) == 3:
            thrice.set()

    with looked_at(look, every_s=0.001):
        assert thrice.wait(30)
        before = len(looks)
    assert len(looks) > before
    assert no_thread_is_left()
