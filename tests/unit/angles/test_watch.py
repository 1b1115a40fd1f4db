from __future__ import annotations

import math

from station.angles.reading import Reading
from station.angles.settings import SourceSettings
from station.angles.watch import INFO, WARNING, Watch

SECOND = 1_000_000_000


def reading(at_s: float, angle_deg: float) -> Reading:
    return Reading(stamp_ns=round(at_s * SECOND), angle_rad=math.radians(angle_deg))


def watch(silent_s: float = 2.0) -> Watch:
    return Watch("imu", settings=SourceSettings(jump_deg=5.0, max_rate_deg_s=60.0), silent_s=silent_s)


def test_silence_is_said_once_and_so_is_its_end() -> None:
    judge = watch()
    judge.opened(0)
    assert judge.take([reading(0.5, 0.0)], now_ns=SECOND // 2) == []
    assert judge.look(2 * SECOND) == []
    notes = judge.look(3 * SECOND)
    assert [note.level for note in notes] == [WARNING]
    assert "imu" in notes[0].text
    assert "2.0 s" in notes[0].text
    assert judge.silent
    assert judge.look(4 * SECOND) == []
    notes = judge.take([reading(5.0, 0.0)], now_ns=5 * SECOND)
    assert [note.level for note in notes] == [INFO]
    assert "4.5 s" in notes[0].text
    assert not judge.silent


def test_one_that_is_asked_may_be_silent() -> None:
    judge = watch(silent_s=0.0)
    judge.opened(0)
    assert judge.look(10_000 * SECOND) == []


def test_a_jump_is_said_once_and_counted() -> None:
    judge = watch()
    judge.take([reading(0.0, 1.0)], now_ns=0)
    spikes = [reading(0.01, 40.0), reading(0.02, 1.0), reading(0.03, 40.0), reading(0.04, 1.0)]
    notes = judge.take(spikes, now_ns=SECOND // 20)
    assert len(notes) == 1
    assert "jumped from 1.00 to 40.00 degrees" in notes[0].text
    after = [judge.take([reading(s, 1.0)], now_ns=round(s * SECOND)) + judge.look(round(s * SECOND)) for s in (2, 4, 6)]
    said = [note.text for notes in after for note in notes]
    assert said == ["The angle source imu jumped 4 times in all; it has been well since."]


def test_noise_and_a_moving_plate_are_no_jumps() -> None:
    judge = watch()
    assert judge.take([reading(i * 0.01, 0.4 * (-1) ** i) for i in range(100)], now_ns=SECOND) == []
    # 30 degrees a second, seen ten times a second
    assert judge.take([reading(1 + i * 0.1, 3.0 * i) for i in range(20)], now_ns=3 * SECOND) == []


def test_what_is_unreadable_is_quoted_once() -> None:
    judge = watch()
    first = judge.unreadable("the line 'ERR' holds no angle", now_ns=0)
    assert "'ERR'" in first[0].text
    assert judge.unreadable("the line 'ERR' holds no angle", now_ns=1) == []
    assert "2 times in all" in judge.look(6 * SECOND)[-1].text or judge.silent
