"""A diagnosis of thousands of runs has to fit into memory: what is no longer needed is not kept."""

from __future__ import annotations

import gc
import weakref

from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.setting import Setting
from tests.unit.diagnosis import recorded


def test_evidence_lets_the_recording_go() -> None:
    signals = recorded.joined([recorded.session()])
    corners = weakref.ref(signals.corners.corner_px)
    evidence = evidence_of(signals, Setting(opening_radius_m=recorded.OPENING_RADIUS_M))
    del signals
    gc.collect()
    assert {"onset", "along", "rest"} <= {channel.name for channel in evidence.channels}
    assert corners() is None
