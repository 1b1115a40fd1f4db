"""The friction that brakes a block on its way: what slides by its own weight meets no more than it broke free of.

Friction holds a block up to the tilt at which it slides, and takes less from it then, or as much. Where friction grows
with speed, it does so while the block still gains speed: it has not met more than the steepest tilt so far has pulled.
So on a plate that is not tilted back a sliding block is never slowed down, and on one that is, by no more than gravity
gives up. A block that is pushed, or hops on a plate that is tapped, is braked by all of its static friction, at any
tilt. Friction that differs from place to place brakes as well, by less. Frames tell only so much of a stop: a block
that is pushed by hardly 0.02 m/s stops within two of them, and may as well have met a rougher place.
"""

from __future__ import annotations

import math

import numpy as np

from shared.geometry import Array
from station.friction.onset_loads import GRAVITY_M_S2
from station.rig.opening import TOUCH_M, Opening
from station.sampling.no_slide import UNLEVEL_RAD, Seen
from station.sampling.unseen import reach_m

_ROUGHER = 1.5
"""The most friction that a sliding block may meet, as a factor on what it broke free of: a spot of dirt has up to half
as much again as its surroundings (`station effects friction_patch`), a pushed block meets 2.7 times as much where
friction holds to 21 degrees and it is pushed at 8 (`pytest tests/recovery/test_pushed_blocks.py`)."""
_SURE = 4.0
"""Standard errors that a friction must lie above: of the thousand that a path tells, most of them of the same frames,
one is off by so much in a path of a hundred (`pytest tests/unit/sampling/test_braking.py -k noise`)."""
_FRAMES = 12
"""The longest stretch, in frames, to either side of the moment at which a friction is read. Under ten times the usual
noise stretches of 2 frames tell 44 of 60 pushes, of up to 6 and more 52 (`pytest tests/unit/sampling/test_braking.py -k
stretches`)."""
_LIP_M = 0.012
"""Foam may begin so much nearer than the rig file says: a lip of it does, and an opening and the plate's middle are
measured by hand (`station effects border_contact`, `pytest tests/unit/sampling/test_braking.py -k foam`)."""


def pushed(seen: Seen, *, since: int) -> bool:
    """Returns true if a block was braked as no place of a plate brakes what slides by itself.

    It is looked at from the frame `since` on, and must not have met the foam.
    """
    way = seen.place_m - seen.place_m[since]
    farthest = way[int(np.linalg.norm(way, axis=1).argmax())]
    length = float(np.linalg.norm(farthest))
    if len(way) < 2 * _FRAMES or length == 0.0:
        return False
    along = _without_misread(way @ (farthest / length))
    steepest, noise_m = np.maximum.accumulate(seen.tilt_rad), _noise_m(along, since=since)
    return any(
        _braked(seen, along, steepest, noise_m=noise_m, frames=frames, since=since) for frames in range(1, _FRAMES + 1)
    )


def _braked(seen: Seen, along_m: Array, steepest_rad: Array, *, noise_m: float, frames: int, since: int) -> bool:
    """Returns true if the speeds in so many frames to either side of a moment tell of a push.

    What gravity gives and the block has not gained as speed, friction has taken.
    """
    here = slice(max(frames, since + 1), len(along_m) - frames)
    if here.stop <= here.start:
        return False
    ago, on = slice(here.start - frames, here.stop - frames), slice(here.start + frames, None)
    before_s, after_s = seen.time_s[here] - seen.time_s[ago], seen.time_s[on] - seen.time_s[here]
    before, after = (along_m[here] - along_m[ago]) / before_s, (along_m[on] - along_m[here]) / after_s
    gained = after - before
    error = noise_m * np.sqrt(before_s**-2 + after_s**-2 + (1.0 / before_s + 1.0 / after_s) ** 2)
    press = GRAVITY_M_S2 * np.cos(seen.tilt_rad[here]) * 0.5 * (before_s + after_s)
    mu, steepest = np.tan(seen.tilt_rad[here]) - gained / press, steepest_rad[here]
    return bool((mu - _SURE * error / press > _ROUGHER * np.tan(steepest + UNLEVEL_RAD)).any())


def _without_misread(along_m: Array) -> Array:
    """Returns places (n,), m, each the median of itself and of where the two before and the two after it lead.

    A frame that is misread goes, and a smooth way and its stops stay.
    """
    inner = along_m[2:-2]
    before, after = 2.0 * along_m[1:-3] - along_m[:-4], 2.0 * along_m[3:-1] - along_m[4:]
    return np.concatenate([along_m[:2], np.median([inner, before, after], axis=0), along_m[-2:]])


def _noise_m(along_m: Array, *, since: int) -> float:
    """Returns the noise of places (n,), m, on a smooth way, by their third differences, which hold √20 of it.

    A stamp that jitters puts a frame off by more, the faster the block is: the noisiest part counts.
    """
    jerks = np.abs(np.diff(along_m, 3))
    parts = [part for part in (jerks, *np.array_split(jerks[since:], 2)) if len(part)]
    return max(float(np.median(part)) for part in parts) / (0.6745 * math.sqrt(20.0))


def before_foam(seen: Seen, outline_m: Array, opening: Opening, *, down: Array) -> int:
    """Returns the number of frames in which the block cannot have come to the foam before the next one.

    Args:
        seen: the path.
        outline_m: the block's corners (n, 4, 2) on the plate, m.
        opening: the opening in the foam.
        down: unit vector (2,) of the steepest way down the plate, in which a block goes that has not moved yet.
    """
    if len(seen.time_ns) < 2:
        return 0
    way = seen.place_m - seen.place_m[0]
    length = np.linalg.norm(way, axis=1)
    heading = np.where((length > TOUCH_M)[:, None], way / np.maximum(length, TOUCH_M)[:, None], down)
    apart_s = np.diff(seen.time_s, append=2.0 * seen.time_s[-1] - seen.time_s[-2])
    speed = np.linalg.norm(np.diff(seen.place_m, axis=0, prepend=seen.place_m[:1]), axis=1) / np.roll(apart_s, 1)
    near = opening.way_m(outline_m, heading) < reach_m(speed, apart_s, tilt_rad=seen.tilt_rad) + _LIP_M + TOUCH_M
    return int(near.argmax()) if near.any() else len(near)
