"""Sizes of packed pictures, read from their headers: some kB may unpack to gigabytes, and a picture is a stranger's."""

from __future__ import annotations

import struct
from typing import Any

MOST_PIXELS = 64_000_000
"""The largest camera for a Pi gives 9152 x 6944. Of this size the costliest JPEG unpacks within 430 MB (three colours,
progressive), a PNG within 130 MB."""
_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_PNG = _SIGNATURE + b"\x00\x00\x00\x0dIHDR"
_FRAMES = {*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC}
"""JPEG's markers before the size of the picture: start of frame, of whichever coding."""
_ALONE = {0x01, *range(0xD0, 0xDA)}
"""JPEG's markers without a length."""


def size_px(data: bytes) -> tuple[int, int] | None:
    """Returns the width and height of a JPEG or a PNG, without unpacking it; None if it is none."""
    if data.startswith(_PNG) and len(data) >= len(_PNG) + 8:
        return struct.unpack_from(">II", data, len(_PNG))
    return _jpeg_size(data) if data.startswith(b"\xff\xd8") else None


def too_large(data: bytes) -> str:
    """Returns words on a picture of more pixels than any camera here gives; empty for all others."""
    size = size_px(data)
    if size is None or size[0] * size[1] <= MOST_PIXELS:
        return ""
    return f"a picture of {size[0]} x {size[1]} pixels, of which at most {MOST_PIXELS / 1e6:.0f} million are unpacked"


def unpacked(data: bytes) -> Any:
    """Returns the grey picture (height, width) in a JPEG or PNG.

    It is None for what is no picture, cannot be unpacked or is too large.
    """
    return None if size_px(data) is None else unpacked_of_any_kind(data)


def unpacked_of_any_kind(data: bytes) -> Any:
    """Returns the same of whatever OpenCV reads: for files of the user's own, since other kinds tell no size here."""
    import cv2  # noqa: PLC0415  # who only sends and records pictures does without it
    import numpy as np  # noqa: PLC0415

    if not data or too_large(data) or _overruns(data):
        return None
    try:
        return cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_GRAYSCALE)
    except cv2.error:
        return None


def _overruns(data: bytes) -> bool:
    """Returns true for a PNG of which a part claims to end behind it.

    OpenCV takes as much memory as a part claims, 4 GB.
    """
    if not data.startswith(_SIGNATURE):
        return False
    position = len(_SIGNATURE)
    while position + 8 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, position)
        if kind == b"IEND":
            return False
        position += 12 + length  # beside the content its length, its kind and a checksum
    return position > len(data)


def _jpeg_size(data: bytes) -> tuple[int, int] | None:
    position = 2
    while position + 9 <= len(data) and data[position] == 0xFF:
        marker = data[position + 1]
        if marker in _FRAMES:
            height, width = struct.unpack_from(">HH", data, position + 5)
            return width, height
        if marker == 0:  # no marker, but a byte of data: decoders look on behind it, each in its own way
            return None
        position += _length(data, position)
    return None


def _length(data: bytes, position: int) -> int:
    """Returns the length of the part that begins there; a byte 0xFF before a marker only fills the space."""
    marker = data[position + 1]
    if marker == 0xFF:
        return 1
    return 2 if marker in _ALONE else 2 + struct.unpack_from(">H", data, position + 2)[0]
