"""The estimators of an edge's place: what they answer to steps of known place, blur, motion blur and slope."""

from math import erf

import numpy as np
import pytest
from numpy.typing import NDArray

from pi_agent.tracking.steps import MOTION_BLUR_STEP, StepModel, moving_models, step_model

Floats = NDArray[np.float64]

MODELS = {
    "margin": step_model(textured=False),
    "grain": step_model(textured=True),
    "grain, known blur": step_model(textured=True, known_blur=True),
}


def _step(u: Floats, *, place: float, blur: float = 1.0, motion_blur: float = 0.0) -> Floats:
    """A step from 0 to 1 by numbers: the mean of many blurred ones along the way."""
    way = motion_blur * ((np.arange(400) + 0.5) / 400 - 0.5)
    means = [np.mean([0.5 * (1 + erf((x - place - w) / blur / np.sqrt(2))) for w in way]) for x in u]
    return np.asarray(means, dtype=np.float64)


def _read(model: StepModel, light: Floats) -> tuple[float, float]:
    """Place and relative error of the blur, of one profile."""
    answer = light.astype(np.float32)[None, None] @ model.solve
    place = float(model.table.place(answer[:, :, 1] / answer[:, :, 0])[0, 0])
    return place, float(answer[0, 0, 2] / answer[0, 0, 0]) - float(model.widening) * place * place


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("place", [-0.4, -0.2, 0.0, 0.3, 0.4])
def test_a_step_is_read_where_it_lies_at_any_level_and_contrast(name: str, place: float) -> None:
    model = MODELS[name]
    read, blur_error = _read(model, 12.0 + 85.0 * _step(model.steps, place=place))
    assert read == pytest.approx(place, abs=2e-3)
    assert blur_error == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("name", ["margin", "grain"])
def test_a_wider_step_is_read_as_wider_and_in_the_same_place(name: str) -> None:
    model = MODELS[name]
    read, blur_error = _read(model, _step(model.steps, place=0.0, blur=1.04))
    assert blur_error == pytest.approx(0.04, abs=0.005)
    assert read == pytest.approx(0.0, abs=0.01)


@pytest.mark.parametrize("textured", [True, False])
@pytest.mark.parametrize("motion_blur", [0.3, 1.6 * MOTION_BLUR_STEP, 2.13, 4.9])
def test_a_step_in_motion_is_read_where_its_middle_lies(textured: bool, motion_blur: float) -> None:
    model, (made_for, *_) = moving_models(textured=textured).at(np.full(4, motion_blur))
    light = np.stack([_step(model.steps[0], place=place, motion_blur=motion_blur) for place in (-0.4, 0.0, 0.3)])
    answer = np.broadcast_to(light.astype(np.float32), (4, *light.shape)) @ model.solve
    read = model.table.place(answer[:, :, 1] / answer[:, :, 0])
    longer = float(model.motion_blur_gain[0]) * (motion_blur - made_for)
    np.testing.assert_allclose(read[0] - longer, [-0.4, 0.0, 0.3], atol=0.01)


def test_a_longer_motion_blur_moves_the_foot_as_the_model_says() -> None:
    model, _ = moving_models(textured=True).at(np.full(4, 3.0))
    light = _step(model.steps[0], place=0.0, motion_blur=3.2).astype(np.float32)
    answer = np.broadcast_to(light, (4, 1, len(light))) @ model.solve
    read = float(model.table.place(answer[:, :, 1] / answer[:, :, 0])[0, 0])
    assert abs(read) > 0.02
    assert read == pytest.approx(0.2 * float(model.motion_blur_gain[0]), abs=0.01)


@pytest.mark.parametrize("name", MODELS)
def test_a_slope_in_the_light_is_allowed_for_by_the_estimator_that_is_asked_to(name: str) -> None:
    model = MODELS[name]
    light = _step(model.steps, place=0.2) + 0.08 * model.steps
    answer = light.astype(np.float32)[None, None] @ model.solve
    read = float(model.sloped().table.place(answer[:, :, 6] / answer[:, :, 5])[0, 0])
    assert read == pytest.approx(0.2, abs=0.01)
    assert float(np.sqrt(np.sum((light @ model.sloped().misfit) ** 2))) < 0.01


def test_light_that_changes_across_an_edge_pulls_one_of_two_estimators() -> None:
    model = MODELS["margin"]
    light = _step(model.steps, place=0.0) * (1.0 + 0.02 * model.steps)
    answer = light.astype(np.float32)[None, None] @ model.solve
    plain = float(model.table.place(answer[:, :, 1] / answer[:, :, 0])[0, 0])
    other = float(model.other_table.place(answer[:, :, 4] / answer[:, :, 3])[0, 0])
    assert abs(plain) > 0.03
    assert other == pytest.approx(0.0, abs=0.004)


@pytest.mark.parametrize("motion_blur", [0.0, 0.25, 1.5, 4.0])
def test_what_reading_between_the_pixels_adds_to_the_blur_of_an_edge_in_motion_is_undone(motion_blur: float) -> None:
    """A line between two pixels cuts a bow off: it adds half the second derivative times f (1 - f) to the light."""
    model, (made_for, *_) = moving_models(textured=True).at(np.full(4, motion_blur))
    assert model.uneven is not None
    steps, sharp = model.steps[0], 0.86
    wider = 0.05  # a share of the blur's square, more than the mean
    fine = np.stack(
        [_step(steps + shift, place=0.0, blur=sharp, motion_blur=float(made_for)) for shift in (-0.05, 0.0, 0.05)]
    )
    bow = (fine[0] - 2.0 * fine[1] + fine[2]) / 0.05**2
    plain = _step(steps, place=0.0, motion_blur=float(made_for))
    light = np.stack([plain, plain + wider * bow]).astype(np.float32)
    answer = light @ model.solve[0] - np.outer([0.0, wider], np.ones(len(steps))).astype(np.float32) @ model.uneven[0]
    place = answer[:, 1] / answer[:, 0]
    undone = light[1] @ model.solve[0]
    assert abs(undone[1] / undone[0] - place[0]) > 0.02
    assert abs(place[1] - place[0]) < 0.003
