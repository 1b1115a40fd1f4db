"""Pictures from strangers: unpacked in the size that their header tells, or not at all."""

from __future__ import annotations

import os
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from random import Random

import cv2
import numpy as np

from shared.pictures import MOST_PIXELS, size_px, unpacked
from tests.fuzz.change import of_bytes
from tests.fuzz.target import Target, Unclear


def _damaged(random: Random) -> bytes:
    picture = np.full((30, 40), 99, np.uint8)
    picture[10:20, 10:20] = 200
    options = [cv2.IMWRITE_JPEG_PROGRESSIVE, 1] if random.random() < 0.3 else []
    data = cv2.imencode(".jpg", picture, options) if random.random() < 0.6 else cv2.imencode(".png", picture)
    return of_bytes(random, data[1].tobytes())


def _as_told(path: Path) -> None:
    """A picture that was unpacked has the pixels of its header, lying or standing, and no more than a camera gives."""
    data = path.read_bytes()
    with _silence():
        found, told = unpacked(data), size_px(data)
    if found is not None and (told is None or {*found.shape} != {*told} or found.size > MOST_PIXELS):
        raise Unclear(f"a picture of {told} is unpacked to {found.shape}")


@contextmanager
def _silence() -> Generator[None]:
    """Keeps to itself what the decoders' libraries write to standard error, in C."""
    kept = os.dup(2)
    try:
        with Path(os.devnull).open("wb") as nowhere:
            os.dup2(nowhere.fileno(), 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)


TARGETS = (Target("picture", ".img", _damaged, _as_told, share=1.0),)
