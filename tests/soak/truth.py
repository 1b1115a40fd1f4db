"""`python -m tests.soak.truth FILE`: each sample of a simulated session against the truth in its file.

It prints how far the onset is from the twin's tilt at the slip, the place at the start from the block's, and the onset
from the friction that was drawn for the run, for samples that count and for those that the foam disturbed; how many
that count are false, with Wilson's interval; and how the onsets' errors compare with those that the samples state.

Exit status 1: a sample that counts has an onset that is FALSE_RAD from its friction, or was held although its friction
is below the tilt by as much, or a sample has a run or a tilt that never was.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shared.messages import Sample, TwinScene
from station.recording.reader import RecordingReader, open_recording
from tests.proof.intervals import wilson

Array = NDArray[np.float64]

FALSE_RAD = math.radians(0.1)
"""A step that begins or ends shakes the block loose some hundredths of a degree early or late: that is its friction."""
LIFTED_RAD = math.radians(0.5)
"""An onset is the tilt that a plate at rest would need: one that stops its turning lets a block go so much earlier."""


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

    def drawn_rad(self, time_ns: Array) -> Array:
        """The friction angle (m,) of the contact before each time (m,)."""
        return self.friction_rad[np.searchsorted(self.time_ns, time_ns) - 1]


def _tilt_rad(scene: TwinScene) -> float:
    return 2.0 * math.asin(min(1.0, math.hypot(scene.qx, scene.qy)))


def column(samples: Sequence[Sample], name: str) -> NDArray[Any]:
    """A field of each sample (n,)."""
    values = [getattr(sample, name) for sample in samples]
    return np.array(values, dtype=np.int64 if name.endswith("_ns") else np.float64)


def main(words: Sequence[str] | None = None) -> int:
    """Prints what was found; 1 if a sample is false."""
    parser = argparse.ArgumentParser(prog="python -m tests.soak.truth", description=__doc__)
    parser.add_argument("file", type=Path, help="a recording of a simulated session")
    reader = open_recording(parser.parse_args(words).file)
    if "truth/scene" not in reader.topics:
        parser.error("expected a simulated session, whose file has the truth on /truth/scene; this one has none")
    return judged(Truth.of(reader), reader.samples())


def judged(truth: Truth, told: Sequence[Sample]) -> int:
    """Prints how the samples compare with the truth; 1 if one is false."""
    slid = [sample for sample in told if not sample.censored]
    count = np.array([not sample.disturbed for sample in slid], dtype=bool)
    slip_ns, onset = column(slid, "slip_ns"), column(slid, "onset_angle_rad")
    tilt, off = onset - truth.at(slip_ns, truth.tilt_rad), onset - truth.drawn_rad(slip_ns)
    held = [sample for sample in told if sample.censored and not sample.disturbed]
    beyond = column(held, "onset_angle_rad") - truth.drawn_rad(column(held, "detect_ns"))
    print(f"{len(told)} samples, {len(told) - len(slid)} censored, {sum(one.disturbed for one in told)} disturbed")
    print(f"onset less the tilt at the slip: {_degrees(tilt)}")
    print(f"place at the start: {_places(truth, slid)}")
    print(f"onset less the friction drawn, samples that count: {_degrees(off[count])}")
    print(f"the same, disturbed: {_degrees(off[~count])}; {len(off[~count]) - _false(off[~count])} of them right")
    wrong, held_wrong = _false(off[count]), int((beyond > FALSE_RAD).sum())
    limit = f"more than {math.degrees(FALSE_RAD):.1f} deg"
    print(f"that count, {limit} off: {_share(wrong, int(count.sum()))}")
    print(f"that count as held, at a tilt {limit} above the friction: {_share(held_wrong, len(held))}")
    print(f"onset's error over the one stated: {_normalised(off[count], column(slid, 'onset_sigma_rad')[count])}")
    twice = len(told) - len({sample.run for sample in told})
    return int(bool(wrong or held_wrong or (np.abs(tilt) > LIFTED_RAD).any() or twice))


def _places(truth: Truth, slid: Sequence[Sample]) -> str:
    start_ns = column(slid, "start_ns")
    place = np.column_stack([column(slid, "start_x_m"), column(slid, "start_y_m")])
    beside = (place - np.column_stack([truth.at(start_ns, each) for each in truth.place_m.T])) * 1e3
    rms = float(np.linalg.norm(beside)) / math.sqrt(beside.size or 1)
    return f"worst {np.abs(beside).max(initial=0.0):.4f} mm, rms {rms:.4f} mm"


def robust_sd(values: Array) -> float:
    """The median distance from the median, scaled to the standard deviation of normal values (n,)."""
    return float(1.4826 * np.median(np.abs(values - np.median(values))))


def _share(found: int, of: int) -> str:
    low, high = wilson(found, of)
    return f"{found} of {of} ({low:.2%} to {high:.2%})"


def _normalised(off_rad: Array, sigma_rad: Array) -> str:
    z = off_rad[sigma_rad > 0] / sigma_rad[sigma_rad > 0]
    return f"n {len(z)}, median {np.median(z):+.2f}, robust sd {robust_sd(z):.2f}" if len(z) else "none"


def _false(off_rad: Array) -> int:
    return int((np.abs(off_rad) > FALSE_RAD).sum())


def _degrees(off_rad: Array) -> str:
    off = np.degrees(off_rad)
    if not len(off):
        return "none"
    return f"n {len(off)}, worst {off[np.abs(off).argmax()]:+.4f} deg, mean {off.mean():+.4f}, sd {off.std():.4f}"


if __name__ == "__main__":
    sys.exit(main())
