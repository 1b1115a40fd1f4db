"""Progress in a log or a pipe."""

from __future__ import annotations

import io
import threading

from rich.console import Console

from station.app.progress import EVERY_S, Told, looked_at, stages


def test_without_a_terminal_a_line_now_and_then_says_how_long_it_takes() -> None:
    now = [0.0]
    out = io.StringIO()
    told = Told(Console(file=out, width=60), total=100, seconds=lambda: now[0])
    told.at(10)
    assert out.getvalue() == ""
    now[0] = 2 * EVERY_S
    told.at(25)
    told.at(26)
    assert out.getvalue() == "25 of 100 samples in 20 s, about 60 s left\n"
    now[0] = 240.0
    told.at(50)
    assert out.getvalue().endswith("50 of 100 samples in 4 min, about 4 min left\n")
    drawn = io.StringIO()
    shown = Told(Console(file=drawn, force_terminal=True), total=100, seconds=lambda: now[0])
    now[0] = 10 * EVERY_S
    shown.at(50)
    assert drawn.getvalue() == ""


def test_without_a_terminal_the_stage_of_long_work_is_told_now_and_then() -> None:
    now = [0.0]
    out = io.StringIO()
    with stages(Console(file=out, width=60), "reading", seconds=lambda: now[0]) as show:
        show("run 1 of 60")
        now[0] = EVERY_S
        show("run 2 of 60")
        show("run 3 of 60")
    assert out.getvalue() == "run 2 of 60, 10 s so far\n"
    drawn = io.StringIO()
    with stages(Console(file=drawn, force_terminal=True), "reading", seconds=lambda: now[0]) as show:
        now[0] = 3 * EVERY_S
        show("run 4 of 60")
    assert "so far" not in drawn.getvalue()


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
    assert not any(thread.name == "progress" for thread in threading.enumerate())
