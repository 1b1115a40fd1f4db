"""`python -m tests.soak.truth FILE`: each sample of a simulated session against the truth in its file.

It prints how far the tilt at the slip is from the twin's, the place at the start from the block's, and the onset from
the friction that was drawn for the run, apart for blocks that lay clear of the foam and at it. Exit status 1: a block
that lay clear has an onset that is FALSE_RAD from its friction, or a sample has a run or a tilt that never was.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from shared.messages import Sample, TwinScene
from station.recording.reader import RecordingReader, open_recording

Array = NDArray[np.float64]

FALSE_RAD = math.radians(0.1)
"""A step that begins or ends shakes the block loose some hundredths of a degree early or late: that is its friction."""
CLEAR_M = 0.036
"""The distance from the middle from which on a corner of a block of 10 mm can touch the round foam of 45 mm."""


@dataclass(frozen=True, eq=False)
class Truth:
    """The twin's scenes: times (n,) ns, friction angle and tilt (n,) rad, the block's place (n, 2) m."""

    time_ns: NDArray[np.int64]
    friction_rad: Array
    tilt_rad: Array
    place_m: Array

    @classmethod
    def of(cls, reader: RecordingReader) -> Truth:
        """All scenes of a recording."""
        scenes = [
            (item.publish_ns, math.atan(one.mu), _tilt_rad(one), one.block_x_m, one.block_y_m)
            for item in reader.messages({"truth/scene"}, truth=True)
            if isinstance(one := item.message, TwinScene)
        ]
        time_ns = np.array([scene[0] for scene in scenes], dtype=np.int64)
        columns = np.asfortranarray([scene[1:] for scene in scenes], dtype=np.float64)
        return cls(time_ns, columns[:, 0], columns[:, 1], columns[:, 2:])

    def at(self, time_ns: Array, values: Array) -> Array:
        """Values (n,) at other times (m,)."""
        first = self.time_ns[0]
        return np.interp(time_ns - first, self.time_ns - first, values)


def _tilt_rad(scene: TwinScene) -> float:
    return 2.0 * math.asin(min(1.0, math.hypot(scene.qx, scene.qy)))


def column(samples: Sequence[Sample], name: str) -> Array:
    """A field of each sample (n,)."""
    return np.array([getattr(sample, name) for sample in samples])


def main(words: Sequence[str] | None = None) -> int:
    """Prints what was found; 1 if a sample is false."""
    parser = argparse.ArgumentParser(prog="python -m tests.soak.truth", description=__doc__)
    parser.add_argument("file", type=Path, help="a recording of a simulated session")
    reader = open_recording(parser.parse_args(words).file)
    if "truth/scene" not in reader.topics:
        parser.error("expected a simulated session, whose file has the truth on /truth/scene; this one has none")
    truth, told = Truth.of(reader), reader.samples()
    slid = [sample for sample in told if not sample.censored]
    slip_ns, start_ns = column(slid, "slip_ns"), column(slid, "start_ns")
    drawn = truth.friction_rad[np.searchsorted(truth.time_ns, slip_ns) - 1]
    tilt = column(slid, "onset_angle_rad") - truth.at(slip_ns, truth.tilt_rad)
    place = np.column_stack([column(slid, "start_x_m"), column(slid, "start_y_m")])
    beside = place - np.column_stack([truth.at(start_ns, each) for each in truth.place_m.T])
    onset, clear = column(slid, "onset_angle_rad") - drawn, np.hypot(*place.T) < CLEAR_M
    print(f"{len(told)} samples, {len(told) - len(slid)} censored")
    print(f"tilt at the slip, measured less true: {_degrees(tilt)}")
    print(f"place at the start: worst {np.abs(beside).max() * 1e3:.4f} mm, sd {beside.std() * 1e3:.4f} mm")
    print(f"onset less the friction drawn, block clear of the foam: {_degrees(onset[clear])}")
    print(f"the same, block at the foam: {_degrees(onset[~clear])}")
    print(
        f"more than {math.degrees(FALSE_RAD):.1f} deg off: {_false(onset[clear])} clear, {_false(onset[~clear])} at it"
    )
    twice = len(told) - len({sample.run for sample in told})
    return int(bool(_false(onset[clear]) or _false(tilt) or twice))


def _false(off_rad: Array) -> int:
    return int((np.abs(off_rad) > FALSE_RAD).sum())


def _degrees(off_rad: Array) -> str:
    off = np.degrees(off_rad)
    if not len(off):
        return "none"
    return f"n {len(off)}, worst {off[np.abs(off).argmax()]:+.4f} deg, mean {off.mean():+.4f}, sd {off.std():.4f}"


if __name__ == "__main__":
    sys.exit(main())
