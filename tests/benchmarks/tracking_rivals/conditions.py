"""The conditions under which tracking is measured: each makes short sequences of frames with known corners."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pi_agent.rendering import (
    ExactRenderer,
    Glare,
    Layer,
    Optics,
    Pose,
    Scene,
    Sensor,
    Shadow,
    plate_fiducials,
    surface,
)
from pi_agent.rendering.painting import EXACT, Quality
from pi_agent.rendering.plates import PAD_PX, Plate
from pi_agent.rendering.projection import corners_px
from pi_agent.rendering.scene import FRAME_PX
from pi_agent.tracking.config import TrackerConfig
from pi_agent.tracking.mark import Feature, Mark
from pi_agent.tracking.shutter import Shutter
from pi_agent.tracking.tone import LINEAR, PI_DEFAULT

Floats = NDArray[np.float64]
Rng = np.random.Generator

FRAME_S = 1 / 90
LARGE_PX = 900  # size of the surfaces that plates are cut out of: turned over at its ends, one would have a seam
MOVING = Quality(fine=3, instants=13, step_px=0.3)
BEFORE = Quality(fine=2, instants=6, step_px=0.7)  # the quality of frames that are followed but not judged
ROLLING = Shutter(line_ns=17_000.0, exposure_ns=2_000_000, row0_dt_ns=-1_000_000.0)


@dataclass(frozen=True)
class Trial:
    """Frames in order, their true corners, the tracker's settings, and what the last frame shows."""

    frames: tuple[NDArray[np.uint8], ...]
    corners: tuple[Floats, ...]
    config: TrackerConfig
    scene: Scene
    pose: Pose

    def capture_ns(self, number: int) -> int:
        """Capture time of a frame."""
        return round(number * FRAME_S * 1e9)


Maker = Callable[[Rng], Trial]


class Plates:
    """Parts of a few large surfaces of each kind, turned and mirrored: making one takes longer than a frame.

    They are made when the first is asked for, since every run of the tests imports this module.
    """

    @cached_property
    def _fields(self) -> dict[str, list[Plate]]:
        rng = np.random.default_rng(77)
        fields = {kind: [surface(kind, rng=rng, size=LARGE_PX) for _ in range(4)] for kind in ("wood", "steel")}
        return fields | {"plain": [surface("plain", rng=rng, size=LARGE_PX)]}

    def pick(self, rng: Rng, kind: str | None = None) -> Plate:
        """A surface of the kind, or of wood or steel."""
        fields = self._fields[kind or ("wood", "steel")[int(rng.integers(2))]]
        field = np.rot90(fields[int(rng.integers(len(fields)))], int(rng.integers(4)))
        size = FRAME_PX + 2 * PAD_PX
        row, column = rng.integers(0, len(field) - size, 2).tolist()
        part = field[row : row + size, column : column + size]
        return np.ascontiguousarray(part[::-1] if rng.random() < 0.5 else part)


PLATES = Plates()


def random_mark(rng: Rng, *, margin: float = 0.0, feature: Feature = "none", aspect: float = 1.0) -> Mark:
    """A mark of 60 to 120 px."""
    return Mark(side_mm=float(rng.uniform(10, 20)), margin=margin, feature=feature, aspect=aspect, tag_id=7)


def random_pose(rng: Rng) -> Pose:
    """Anywhere on the plate where the whole mark is seen, at any yaw."""
    x, y = rng.uniform(-26, 26, 2).tolist()
    return Pose(x, y, float(rng.uniform(0, 2 * np.pi)))


def nudged(pose: Pose, rng: Rng) -> Pose:
    """A little further: 0.3 px and 0.1 degree."""
    dx, dy = rng.normal(0, 0.05, 2).tolist()
    return replace(pose, x_mm=pose.x_mm + dx, y_mm=pose.y_mm + dy, yaw_rad=pose.yaw_rad + float(rng.normal(0, 0.002)))


def still(
    scene: Scene, rng: Rng, *, quality: Quality = EXACT, disturbed: Scene | None = None, pose: Pose | None = None
) -> Trial:
    """Two frames of a block that hardly moves; the second one of the disturbed scene."""
    first = pose or random_pose(rng)
    second = nudged(first, rng) if pose is None else first
    renderer = ExactRenderer(scene, quality=quality)
    shots = [renderer.render(first, rng=rng)]
    last = renderer if disturbed is None else renderer.in_scene(disturbed)
    shots.append(last.render(second, rng=rng))
    config = TrackerConfig(mark=scene.mark, tone=scene.sensor.tone, shutter=scene.shutter)
    frames, corners = zip(*shots, strict=True)
    return Trial(frames, corners, config, disturbed or scene, second)


def clean(rng: Rng) -> Trial:
    """A uniform plate, little noise, a straight tone curve."""
    sensor = Sensor(full_scale_e=60_000, read_noise_e=2)
    return still(Scene(PLATES.pick(rng, "plain"), mark=random_mark(rng), sensor=sensor), rng)


def clean_aligned(rng: Rng) -> Trial:
    """The same along the pixels or across them, where all places on an edge lie alike between the pixels."""
    sensor = Sensor(full_scale_e=60_000, read_noise_e=2)
    pose = replace(random_pose(rng), yaw_rad=float(rng.integers(8)) * np.pi / 4)
    return still(Scene(PLATES.pick(rng, "plain"), mark=random_mark(rng), sensor=sensor), rng, pose=pose)


def nominal(rng: Rng) -> Trial:
    """Bare tape on wood or steel, noise, vignetting, the Pi's own tone curve (known to the tracker)."""
    sensor = Sensor(tone=PI_DEFAULT)
    return still(Scene(PLATES.pick(rng), mark=random_mark(rng), sensor=sensor, fiducials=plate_fiducials()), rng)


def nominal_linear(rng: Rng) -> Trial:
    """Bare tape, a straight tone curve."""
    return still(Scene(PLATES.pick(rng), mark=random_mark(rng), fiducials=plate_fiducials()), rng)


def recommended(rng: Rng) -> Trial:
    """White margin, dot, straight tone curve."""
    mark = random_mark(rng, margin=0.16, feature="dot")
    return still(Scene(PLATES.pick(rng), mark=mark, fiducials=plate_fiducials()), rng)


def with_tag(rng: Rng) -> Trial:
    """White margin, AprilTag code, straight tone curve."""
    mark = random_mark(rng, margin=0.16, feature="tag")
    return still(Scene(PLATES.pick(rng), mark=mark, fiducials=plate_fiducials()), rng)


def with_notch(rng: Rng) -> Trial:
    """White margin, notch, straight tone curve."""
    mark = random_mark(rng, margin=0.16, feature="notch")
    return still(Scene(PLATES.pick(rng), mark=mark, fiducials=plate_fiducials()), rng)


def rectangle(rng: Rng) -> Trial:
    """The paper's rectangle-like marker: bare tape, one side longer."""
    mark = Mark(side_mm=float(rng.uniform(10, 15)), aspect=1.25)
    return still(Scene(PLATES.pick(rng), mark=mark, fiducials=plate_fiducials()), rng)


def blurred(rng: Rng) -> Trial:
    """The recommended mark out of focus: 1.2 to 2 px."""
    mark = random_mark(rng, margin=0.16, feature="dot")
    optics = Optics(blur_px=float(rng.uniform(1.2, 2.0)))
    return still(Scene(PLATES.pick(rng), mark=mark, optics=optics, fiducials=plate_fiducials()), rng)


def _recommended(rng: Rng) -> Scene:
    """The recommended mark under a rolling shutter."""
    mark = random_mark(rng, margin=0.16, feature="dot")
    return Scene(PLATES.pick(rng), mark=mark, shutter=ROLLING, fiducials=plate_fiducials())


def _tape(rng: Rng) -> Scene:
    """Bare tape under a rolling shutter."""
    return Scene(PLATES.pick(rng), mark=random_mark(rng), shutter=ROLLING, fiducials=plate_fiducials())


def sliding(rng: Rng) -> Trial:
    """0.3 m/s in any direction, turning at up to 3 rad/s, rolling shutter, 2 ms exposure; recommended mark."""
    return moving(_recommended(rng), rng, speed_mm_s=300.0, turn_rad_s=3.0)


def sliding_tape(rng: Rng) -> Trial:
    """The same with bare tape."""
    return moving(_tape(rng), rng, speed_mm_s=300.0, turn_rad_s=3.0)


def moving(scene: Scene, rng: Rng, *, speed_mm_s: float, turn_rad_s: float, frames: int = 5) -> Trial:
    """Frames of a block at constant speed through the plate's middle."""
    direction = float(rng.uniform(0, 2 * np.pi))
    vx, vy = speed_mm_s * np.cos(direction), speed_mm_s * np.sin(direction)
    turn, yaw = float(rng.uniform(-turn_rad_s, turn_rad_s)), float(rng.uniform(0, 2 * np.pi))
    times = ((number - 0.5 * (frames - 1)) * FRAME_S for number in range(frames))
    return filmed(scene, rng, [Pose(vx * time, vy * time, yaw + turn * time, vx, vy, turn) for time in times])


def filmed(scene: Scene, rng: Rng, poses: Sequence[Pose]) -> Trial:
    """A frame of each pose; only the last one, which is judged, is drawn as exactly as it can be."""
    before, last = ExactRenderer(scene, quality=BEFORE), ExactRenderer(scene, quality=MOVING)
    shots = [before.render(pose, rng=rng) for pose in poses[:-1]]
    shots.append(last.render(poses[-1], rng=rng))
    config = TrackerConfig(mark=scene.mark, tone=scene.sensor.tone, shutter=scene.shutter)
    frames, corners = zip(*shots, strict=True)
    return Trial(frames, corners, config, scene, poses[-1])


def begun(rng: Rng) -> Trial:
    """The beginning of a slide, rolling shutter: from rest at 1 to 5 m/s² to 0.3 m/s or to any frame before."""
    return beginning(_recommended(rng), rng)


def begun_tape(rng: Rng) -> Trial:
    """The same with bare tape."""
    return beginning(_tape(rng), rng)


def beginning(scene: Scene, rng: Rng, *, at_rest: int = 3, fastest_mm_s: float = 300.0) -> Trial:
    """Frames of a block at rest that begins to slide within one, and to turn; the last one is any before the fastest.

    The middle of the plate is half way.
    """
    gain = float(rng.uniform(1000.0, 5000.0))
    lasts_s = fastest_mm_s / gain
    began_s = (at_rest - float(rng.uniform())) * FRAME_S
    count = at_rest + 1 + int(rng.integers(1 + int(lasts_s / FRAME_S)))
    direction, yaw = rng.uniform(0, 2 * np.pi, 2).tolist()
    turn_per_mm = float(rng.uniform(-0.01, 0.01))
    path = gain * np.array([np.cos(direction), np.sin(direction), turn_per_mm])
    start = -0.25 * fastest_mm_s * lasts_s / gain * path[:2]
    times = (number * FRAME_S - began_s for number in range(count))
    poses = [speeding_up((*start.tolist(), yaw), path.tolist(), since_s=time) for time in times]
    return filmed(scene, rng, poses)


def speeding_up(start: tuple[float, float, float], gain: Sequence[float], *, since_s: float) -> Pose:
    """A block that left its place (x, y in mm, yaw) at rest `since_s` ago (below 0: that long from now on).

    `gain`: of its velocities (mm/s², rad/s²).
    """
    x, y, yaw = (z + 0.5 * g * since_s**2 for z, g in zip(start, gain, strict=True))
    vx, vy, turn = (g * since_s for g in gain)
    return Pose(x, y, yaw, vx, vy, turn, gain=(gain[0], gain[1], gain[2]), moves_s=(-since_s, np.inf))


def slowing(rng: Rng) -> Trial:
    """The end of a slide, rolling shutter: from 0.3 m/s it slows down by 1 to 5 m/s² and lies; any frame of it."""
    return ending(_recommended(rng), rng, loss=float(rng.uniform(1000.0, 5000.0)))


def slowing_tape(rng: Rng) -> Trial:
    """The same with bare tape."""
    return ending(_tape(rng), rng, loss=float(rng.uniform(1000.0, 5000.0)))


def struck(rng: Rng) -> Trial:
    """A slide at 0.3 m/s that a wall ends, rolling shutter; any frame before and after, and that of the blow."""
    return ending(_recommended(rng), rng)


def struck_tape(rng: Rng) -> Trial:
    """The same with bare tape."""
    return ending(_tape(rng), rng)


def ending(scene: Scene, rng: Rng, *, loss: float = 0.0, speed_mm_s: float = 300.0, at_rest: int = 4) -> Trial:
    """Frames of a block that slides, loses `loss` (mm/s²) of its speed, and lies; without it, that is stopped at once.

    The last frame is any but the first three; the slide ends in the middle of the plate, or its middle is half way.
    """
    lasts_s = speed_mm_s / loss if loss else 5 * FRAME_S
    ends_s = lasts_s + float(rng.uniform()) * FRAME_S
    count = 4 + int(rng.integers(int(ends_s / FRAME_S) + at_rest - 3))
    direction, yaw = rng.uniform(0, 2 * np.pi, 2).tolist()
    along = np.array([np.cos(direction), np.sin(direction)])
    final_mm_s = 0.0 if loss else speed_mm_s
    poses = list[Pose]()
    for number in range(count):
        since_s = number * FRAME_S - ends_s
        way = final_mm_s * since_s - 0.5 * loss * since_s**2 + 0.25 * loss * lasts_s**2
        x, y, vx, vy = (*(way * along).tolist(), *((final_mm_s - loss * since_s) * along).tolist())
        gain_x, gain_y = (-loss * along).tolist()
        poses.append(Pose(x, y, yaw, vx, vy, gain=(gain_x, gain_y, 0.0), moves_s=(-np.inf, -since_s)))
    return filmed(scene, rng, poses)


def _adverse(rng: Rng, mark: Mark, disturb: Callable[[Scene, Floats, Rng], Scene]) -> Trial:
    """An undisturbed frame, then a disturbed one."""
    tone = PI_DEFAULT if rng.random() < 0.3 else LINEAR
    scene = Scene(PLATES.pick(rng), mark=mark, sensor=Sensor(tone=tone), fiducials=plate_fiducials())
    pose = random_pose(rng)
    disturbed = disturb(scene, corners_px(scene, pose), rng)
    return still(scene, rng, disturbed=disturbed, pose=pose)


def glare(rng: Rng, mark: Mark) -> Trial:
    """One to three highlights on or near the mark."""

    def disturb(scene: Scene, corners: Floats, rng: Rng) -> Scene:
        centre = corners.mean(axis=0)
        places = centre + rng.normal(0, 55, (int(rng.integers(1, 4)), 2))
        spots = [Glare(x, y, float(rng.uniform(5, 40)), float(rng.uniform(0.3, 2.0))) for x, y in places.tolist()]
        return replace(scene, glare=tuple(spots))

    return _adverse(rng, mark, disturb)


def clutter(rng: Rng, mark: Mark) -> Trial:
    """Dark and bright things on the plate, some of them within 3 px of the mark."""

    def disturb(scene: Scene, corners: Floats, rng: Rng) -> Scene:
        reach = float(np.linalg.norm(corners - corners.mean(axis=0), axis=1).max()) * (1 + 2 * scene.mark.margin)
        things: list[Layer] = []
        while len(things) < 8:
            polygon = _thing(rng)
            gap = np.linalg.norm(_dense(polygon) - corners.mean(axis=0), axis=1).min() - reach
            if gap > 3.0 and not _holds(polygon, corners.mean(axis=0)):
                things.append(Layer((polygon,), float(rng.uniform(0.03, 0.9))))
        return replace(scene, clutter=tuple(things))

    return _adverse(rng, mark, disturb)


def occlusion(rng: Rng, mark: Mark) -> Trial:
    """A finger, wire or corner of paper over 2 to 25 % of the outline."""

    def disturb(scene: Scene, corners: Floats, rng: Rng) -> Scene:
        outline = _dense(corners)
        while True:
            middle = outline[int(rng.integers(len(outline)))]
            polygon = _thing(rng) - 300.0 + middle + rng.normal(0, 12, 2)
            covered = float(np.mean(_holds(polygon, outline[::4])))
            if 0.02 <= covered <= 0.25:
                return replace(scene, occluders=(Layer((polygon,), float(rng.uniform(0.03, 0.9))),))

    return _adverse(rng, mark, disturb)


def dim(rng: Rng, mark: Mark) -> Trial:
    """A sixth to a twentieth of the light."""
    light = float(rng.uniform(0.05, 0.16))
    return _adverse(rng, mark, lambda scene, _corners, _rng: replace(scene, light=light))


def shadow(rng: Rng, mark: Mark) -> Trial:
    """The edge of a shadow across the mark, sharp or soft."""

    def disturb(scene: Scene, corners: Floats, rng: Rng) -> Scene:
        angle = float(rng.uniform(0, 2 * np.pi))
        through = corners.mean(axis=0) + rng.normal(0, 20, 2)
        offset = float(through @ np.array([np.cos(angle), np.sin(angle)]))
        return replace(
            scene, shadows=(Shadow(angle, offset, float(rng.uniform(0.25, 0.7)), float(rng.uniform(0.5, 12))),)
        )

    return _adverse(rng, mark, disturb)


def _thing(rng: Rng) -> Floats:
    """A turned rectangle (4, 2), thin or thick, somewhere in the frame, clockwise as seen."""
    width, height = rng.uniform(3, 40), rng.uniform(15, 140)
    base = 0.5 * np.array([[-width, -height], [width, -height], [width, height], [-width, height]])
    angle = rng.uniform(0, 2 * np.pi)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return base @ turn + rng.uniform(20, 580, 2)


def _dense(polygon: Floats) -> Floats:
    share = np.arange(100)[:, None] / 100
    return np.concatenate([a + share * (b - a) for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True)])


def _holds(polygon: Floats, points: Floats) -> NDArray[np.bool_]:
    """True for points (…, 2) that lie in a convex polygon that is clockwise as seen."""
    step, gap = np.roll(polygon, -1, axis=0) - polygon, points[..., None, :] - polygon
    return np.all(step[:, 0] * gap[..., 1] - step[:, 1] * gap[..., 0] >= 0, axis=-1)


NORMAL: dict[str, Maker] = {
    "clean": clean,
    "clean, aligned": clean_aligned,
    "nominal tape": nominal,
    "tape, linear": nominal_linear,
    "rectangle tape": rectangle,
    "recommended": recommended,
    "tag": with_tag,
    "notch": with_notch,
    "out of focus": blurred,
    "sliding": sliding,
    "sliding tape": sliding_tape,
    "sliding begun": begun,
    "sliding begun, tape": begun_tape,
    "sliding slows": slowing,
    "sliding slows, tape": slowing_tape,
    "sliding struck": struck,
    "sliding struck, tape": struck_tape,
}
_DISTURBANCES = {"glare": glare, "clutter": clutter, "occlusion": occlusion, "dim": dim, "shadow": shadow}


def _on_recommended(make: Callable[[Rng, Mark], Trial]) -> Maker:
    return lambda rng: make(rng, random_mark(rng, margin=0.16, feature="dot"))


def _on_tape(make: Callable[[Rng, Mark], Trial]) -> Maker:
    return lambda rng: make(rng, random_mark(rng))


ADVERSE: dict[str, Maker] = {name: _on_recommended(make) for name, make in _DISTURBANCES.items()}
"""Disturbances of the recommended mark."""
ADVERSE_TAPE: dict[str, Maker] = {f"{name}, tape": _on_tape(make) for name, make in _DISTURBANCES.items()}
"""The same of bare tape."""


def _coded(rng: Rng) -> Mark:
    return random_mark(rng, margin=0.16, feature="tag")


def _on_code(make: Callable[[Rng, Mark], Trial]) -> Maker:
    return lambda rng: make(rng, _coded(rng))


def clean_code(rng: Rng) -> Trial:
    """The mark with a code on a uniform plate, little noise."""
    sensor = Sensor(full_scale_e=60_000, read_noise_e=2)
    return still(Scene(PLATES.pick(rng, "plain"), mark=_coded(rng), sensor=sensor), rng)


def code_by_pi_curve(rng: Rng) -> Trial:
    """The mark with a code, the Pi's own tone curve."""
    scene = Scene(PLATES.pick(rng), mark=_coded(rng), sensor=Sensor(tone=PI_DEFAULT), fiducials=plate_fiducials())
    return still(scene, rng)


def code_out_of_focus(rng: Rng) -> Trial:
    """The mark with a code out of focus: 1.2 to 2 px."""
    optics = Optics(blur_px=float(rng.uniform(1.2, 2.0)))
    return still(Scene(PLATES.pick(rng), mark=_coded(rng), optics=optics, fiducials=plate_fiducials()), rng)


def sliding_code(rng: Rng) -> Trial:
    """The mark with a code at 0.3 m/s, rolling shutter, 2 ms exposure."""
    scene = Scene(PLATES.pick(rng), mark=_coded(rng), shutter=ROLLING, fiducials=plate_fiducials())
    return moving(scene, rng, speed_mm_s=300.0, turn_rad_s=3.0)


CODED: dict[str, Maker] = {
    "code, clean": clean_code,
    "code, nominal": with_tag,
    "code, Pi curve": code_by_pi_curve,
    "code, out of focus": code_out_of_focus,
    "code, sliding": sliding_code,
    **{f"code, {name}": _on_code(make) for name, make in _DISTURBANCES.items()},
}
"""Frames of the mark that ArUco and AprilTag can read, too."""
