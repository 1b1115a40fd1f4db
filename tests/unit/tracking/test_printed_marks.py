"""The printable marks are what the tracker looks for, to scale."""

import importlib.util
import xml.etree.ElementTree as ET
from pathlib import Path
from types import ModuleType

import cv2
import numpy as np
import pytest

from pi_agent.tracking.config import TrackerConfig
from pi_agent.tracking.mark import Mark
from pi_agent.tracking.tracker import Tracker

FOLDER = Path(__file__).parents[3] / "deploy" / "mark"
PX_PER_MM = 6.0


@pytest.fixture(scope="module")
def draw() -> ModuleType:
    spec = importlib.util.spec_from_file_location("draw", FOLDER / "draw.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_files_are_what_the_script_draws(draw: ModuleType) -> None:
    for name, text in draw.drawings().items():
        assert (FOLDER / name).read_text() == text


def test_documents_are_in_millimetres(draw: ModuleType) -> None:
    for text in draw.drawings().values():
        root = ET.fromstring(text)
        size = float(root.attrib["width"].removesuffix("mm"))
        assert [float(x) for x in root.attrib["viewBox"].split()][2:] == [size, size]


def _paint(text: str) -> np.ndarray:
    """The document's boxes and discs on a grey frame; good to 0.2 px (OpenCV paints a polygon's outline too)."""
    fine = 8
    frame = np.full((600 * fine // 2, 600 * fine // 2), 110, dtype=np.uint8)
    scale = PX_PER_MM * fine
    shift = 1 << 10
    for shape in ET.fromstring(text):
        if shape.attrib["fill"] == "none" and float(shape.attrib["x"]) != 0:
            continue
        tone = {"none": 220, "#000": 15, "#fff": 220}[shape.attrib["fill"]]
        if shape.tag.endswith("rect"):
            x, y, side = (float(shape.attrib[key]) for key in ("x", "y", "width"))
            low, high = (20 + np.array([x, y])) * scale - 0.5, (20 + np.array([x + side, y + side])) * scale - 0.5
            box = [(round(float(v) * shift)) for v in (*low, *high)]
            points = np.array([[box[0], box[1]], [box[2], box[1]], [box[2], box[3]], [box[0], box[3]]])
            cv2.fillConvexPoly(frame, points.astype(np.int32), tone, cv2.LINE_8, 10)
        else:
            x, y, r = (float(shape.attrib[key]) for key in ("cx", "cy", "r"))
            centre = (round((20 + x) * scale), round((20 + y) * scale))
            cv2.circle(frame, centre, round(r * scale), tone, -1)
    small = cv2.resize(cv2.GaussianBlur(frame, (0, 0), 0.7 * fine), (300, 300), interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.uint8)


@pytest.mark.parametrize(
    ("name", "side_mm", "feature"), [("mark-10mm.svg", 7.5, "dot"), ("mark-20mm-tag.svg", 15.0, "tag")]
)
def test_a_printed_label_is_found_with_its_identity(name: str, side_mm: float, feature: str) -> None:
    frame = _paint((FOLDER / name).read_text())
    mark = Mark(side_mm=side_mm, margin=1 / 6, feature="tag" if feature == "tag" else "dot")
    for turn in range(4):
        seen = Tracker(TrackerConfig(mark=mark)).track(np.ascontiguousarray(np.rot90(frame, -turn)), capture_ns=0)
        assert seen.found, seen.reason
        assert seen.identity == "marked"
        label_mm = side_mm / 0.75
        first = (20 + 0.5 * (label_mm - side_mm)) * PX_PER_MM - 0.5
        expected = [(first, first), (299 - first, first), (299 - first, 299 - first), (first, 299 - first)][turn]
        np.testing.assert_allclose(seen.corners_px[0], expected, atol=0.2)
        assert np.linalg.norm(seen.corners_px[1] - seen.corners_px[0]) == pytest.approx(side_mm * PX_PER_MM, abs=0.3)
