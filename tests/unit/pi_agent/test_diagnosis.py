import numpy as np
import pytest

from pi_agent.cameras import CameraInfo, Frame
from pi_agent.diagnosis import Diagnosis
from pi_agent.observer import Observer
from pi_agent.synthetic_view import SyntheticOptions, SyntheticView
from shared.messages import MarkerCorners
from tests.unit.pi_agent.rigs import rig, scene

INFO = CameraInfo(name="test", width_px=600, height_px=600, rate_hz=90.0)
GREY = np.full((600, 600), 120, dtype=np.uint8)
RNG = np.random.default_rng(2)
BLACK = RNG.integers(0, 8, (600, 600)).astype(np.uint8)
WHITE = np.full((600, 600), 255, dtype=np.uint8)


def fault_after(image: np.ndarray, seconds: float, *, reason: str = "no mark in this frame") -> str:
    diagnosis = Diagnosis(INFO)
    for stamp_ns in (0, round(seconds * 1e9)):
        diagnosis.see(Frame(image, stamp_ns, 0), MarkerCorners(reason=reason))
    return diagnosis.fault


@pytest.mark.parametrize(
    ("image", "reason", "said"),
    [
        (BLACK, "no mark in this frame", "black"),
        (WHITE, "no mark in this frame", "saturated"),
        (GREY, "no mark in this frame", "No marker"),
        (GREY, "the mark leaves the frame", "reaches out"),
        (GREY, "two marks in this frame: cover one, or set the mark's size", "Two markers"),
        (GREY, "tipping", "tipping"),
    ],
)
def test_each_fault_has_its_sentence(image: np.ndarray, reason: str, said: str):
    assert said in fault_after(image, 0.6, reason=reason)


def test_a_short_absence_is_no_fault():
    assert fault_after(GREY, 0.3) == ""


def test_a_found_marker_clears_the_fault():
    diagnosis = Diagnosis(INFO)
    for stamp_ns in (0, 10**9):
        diagnosis.see(Frame(GREY, stamp_ns, 0), MarkerCorners(reason="no mark in this frame"))
    assert diagnosis.fault
    assert diagnosis.see(Frame(GREY, 2 * 10**9, 0), MarkerCorners(found=True)) == ""


@pytest.mark.parametrize(
    "image", [np.zeros((480, 640), np.uint8), np.zeros((600, 600, 3), np.uint8), np.zeros((600, 600), np.uint16)]
)
def test_a_wrong_format_is_told(image: np.ndarray):
    assert "Expected frames of 600 x 600" in Diagnosis(INFO).format_fault(image)
    assert Diagnosis(INFO).format_fault(GREY) == ""


@pytest.mark.parametrize(("light", "said"), [(0.002, "black"), (4.0, "saturated")])
def test_the_light_is_judged_on_pictures_of_a_plate(light: float, said: str):
    config = rig()
    view = SyntheticView(config, rng=np.random.default_rng(1), options=SyntheticOptions(light=light))
    observer, diagnosis = Observer(config, view.info), Diagnosis(view.info)
    for number in range(2):
        frame = Frame(view.frame(scene(), 0), number * 10**9, number)
        diagnosis.see(frame, observer.block(frame))
    assert said in diagnosis.fault
