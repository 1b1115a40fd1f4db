"""A diagnosis of thousands of runs has to fit into memory: what is no longer needed is not kept."""

from __future__ import annotations

import gc
import weakref
from typing import Any

import pytest

from station.diagnosis.diagnose import examined
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.setting import Setting
from station.physics.catalogue import catalogue
from station.signals.session import Signals
from tests.unit.diagnosis import recorded


def test_evidence_lets_the_recording_go() -> None:
    signals = recorded.joined([recorded.session()])
    corners = weakref.ref(signals.corners.corner_px)
    evidence = evidence_of(signals, Setting(opening_radius_m=recorded.OPENING_RADIUS_M))
    del signals
    gc.collect()
    assert {"onset", "along", "rest"} <= {channel.name for channel in evidence.channels}
    assert corners() is None


def test_a_file_s_signals_go_before_the_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """The readers' results are handed on, and not what was read; nothing holds that while models are fitted."""
    kept, alive = list[weakref.ref[Any]](), list[bool]()

    def read() -> Signals:
        signals = recorded.joined([recorded.session()])
        kept.append(weakref.ref(signals.corners.corner_px))
        return signals

    def fitting(*_: object, **__: object) -> None:
        gc.collect()
        alive.append(kept[0]() is not None)
        raise Stopped

    monkeypatch.setattr("station.diagnosis.diagnose.in_stages", fitting)
    with pytest.raises(Stopped):
        examined(read, catalogue(), setting=Setting(opening_radius_m=recorded.OPENING_RADIUS_M))
    assert alive == [False]


class Stopped(Exception):
    """Ends a diagnosis."""
