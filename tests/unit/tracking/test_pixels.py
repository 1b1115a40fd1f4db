"""Light read between the pixels: by one call for all profiles, and the same point by point."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pi_agent.tracking import pixels
from pi_agent.tracking.tone import LINEAR, PI_DEFAULT, ToneCurve

Points = NDArray[np.complex128]

FRAME = np.random.default_rng(5).integers(0, 256, (90, 120), dtype=np.uint8)


TURN = 1j ** np.arange(4) * np.exp(0.3j)
COUNT, SIZE = 5, 7


def _profiles(middle: complex) -> tuple[Points, Points, Points]:
    """The innermost places (4,) of four middle profiles around a place, the ways along the edges and across them."""
    return middle + TURN * (20.0 - 3.1j), TURN * 6.0, TURN * 6.4j


def _places(first: Points, along: Points, across: Points) -> NDArray[np.complex64]:
    """All places (4, COUNT, SIZE), one by one."""
    edge = ((np.arange(COUNT) + 0.5) / COUNT - 0.5)[:, None]
    offset = along[:, None, None] * edge + across[:, None, None] * np.linspace(0.0, 1.0, SIZE)
    return (first[:, None, None] + offset).astype(np.complex64)


@pytest.mark.parametrize("tone", [LINEAR, PI_DEFAULT], ids=["straight", "curved"])
@pytest.mark.parametrize("exact", [True, False], ids=["by OpenCV", "where OpenCV rounds"])
@pytest.mark.parametrize("middle", [60 + 45j, 12 + 45j], ids=["inside", "across the border"])
def test_profiles_read_what_single_points_do(
    monkeypatch: pytest.MonkeyPatch, tone: ToneCurve, exact: bool, middle: complex
) -> None:
    if exact and not pixels.remap_is_exact():
        pytest.skip("this OpenCV rounds places to 1/32 px")
    monkeypatch.setattr(pixels, "remap_is_exact", lambda: exact)
    reader = pixels.PixelReader(tone.to_light_table())
    reader.open(FRAME)
    ways = _profiles(middle)
    one_by_one = reader.bilinear(_places(*ways))
    light, read_at = reader.profiles(*ways, count=COUNT, size=SIZE)
    np.testing.assert_allclose(light, one_by_one, atol=0.02)
    shares = np.stack([_places(*ways).real, _places(*ways).imag], axis=1).reshape(8, -1)
    np.testing.assert_allclose(np.cos(2 * np.pi * read_at), np.cos(2 * np.pi * shares), atol=2e-3)


def test_rows_that_are_padded_are_read_alike() -> None:
    padded = np.zeros((90, 128), dtype=np.uint8)
    padded[:, :120] = FRAME
    answers = []
    for frame in (FRAME, padded[:, :120]):
        reader = pixels.PixelReader(LINEAR.to_light_table())
        reader.open(frame)
        answers.append(reader.profiles(*_profiles(60 + 45j), count=COUNT, size=SIZE)[0])
    np.testing.assert_array_equal(*answers)
