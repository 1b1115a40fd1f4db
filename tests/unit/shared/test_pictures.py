"""A picture is unpacked only when its header tells a size that a camera may have: some kB may be gigabytes."""

from __future__ import annotations

import errno
import struct
import zlib
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest

from pi_agent.__main__ import main as pi_agent
from pi_agent.cameras.video_file import open_pictures
from shared import frames, wire
from shared.clock import SIMULATION_EPOCH_NS as NOW_NS
from shared.errors import UserError
from shared.foxglove import CompressedImage
from shared.pictures import MOST_PIXELS, size_px, unpacked, unpacked_of_any_kind
from station.app.simulated_picture import SimulatedPicture
from station.recording.mcap_file import McapFile
from station.recording.reader import Recorded, open_recording


@cache
def png(side_px: int) -> bytes:
    """A square of black pixels in a thousandth of its size; of large ones the first rows alone."""
    rows = bytes(1 + side_px) * min(side_px, 2000)

    def part(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    head = struct.pack(">IIBBBBB", side_px, side_px, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + part(b"IHDR", head) + part(b"IDAT", zlib.compress(rows)) + part(b"IEND", b"")


def jpeg(width_px: int, height_px: int, *, before: bytes = b"") -> bytes:
    """The header of a JPEG, with bytes before the part that tells its size."""
    return (
        b"\xff\xd8" + before + b"\xff\xc0\x00\x0b\x08" + struct.pack(">HH", height_px, width_px) + b"\x01\x01\x11\x00"
    )


@pytest.mark.parametrize("kind", [".jpg", ".png"])
def test_the_size_is_read_from_the_header(kind: str) -> None:
    picture = np.zeros((30, 40), np.uint8)
    data = cv2.imencode(kind, picture)[1].tobytes()
    assert size_px(data) == (40, 30)
    assert np.array_equal(unpacked(data), picture)


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\xff\xd8",
        b"\xff\xd8\xff",
        b"\xff\xd8\xff\xe0\x00\x00",
        b"\x89PNG",
        png(10)[:23],
        b"\xff\xd8" + b"\xff\xd0" * 50,
        jpeg(8, 8, before=b"\xff\x00"),
        b"II*\x00" + bytes(40),
    ],
)
def test_what_is_no_picture_has_no_size_and_is_not_unpacked(data: bytes) -> None:
    assert size_px(data) is None
    assert unpacked(data) is None


@pytest.mark.parametrize("place", [8, 33])
def test_a_part_that_claims_to_end_behind_its_picture_takes_no_memory(
    place: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """OpenCV takes what the length of a part says; the header's is at 8, that of the pixels at 33."""
    data = png(40)
    assert unpacked(data) is not None
    assert unpacked(data + bytes(100)) is not None, "what stands behind a picture is none of it"

    def unpack(packed: object, how: int) -> None:
        pytest.fail(f"it was unpacked: {packed}, {how}")

    monkeypatch.setattr(cv2, "imdecode", unpack)
    assert unpacked_of_any_kind(data[:place] + b"\xff\x00\x00\x6a" + data[place + 4 :]) is None


def test_bytes_that_fill_the_space_before_a_marker_hide_no_size() -> None:
    """A decoder passes over them; read as a part with a length, they would lead to another size behind them."""
    small = bytes(49152 + 1 - 15) + jpeg(8, 8)[2:]
    assert size_px(jpeg(65500, 65500, before=b"\xff") + small) == (65500, 65500)


@pytest.mark.parametrize("data", [png(10_000), png(60_000), jpeg(65_500, 65_500)])
def test_a_picture_too_large_is_no_message_and_is_left_out_and_counted(data: bytes, tmp_path: Path) -> None:
    assert len(data) < 200_000
    payload = wire.encode(CompressedImage(data=data))
    with pytest.raises(UserError, match="at most 64 million"):
        wire.decode(CompressedImage, payload)
    with (tmp_path / "a.mcap").open("wb") as stream:
        file = McapFile(stream, library="test")
        schema = file.register_schema("foxglove.CompressedImage", wire.schema(CompressedImage))
        channel = file.register_channel("/camera/image", schema_id=schema)
        file.add_message(channel, log_ns=NOW_NS, publish_ns=NOW_NS, sequence=0, payload=payload)
        file.finish()
    reader = open_recording(tmp_path / "a.mcap")
    assert list(reader.messages()) == []
    assert reader.malformed == {"camera/image": 1}
    assert unpacked(data) is None


def test_the_largest_camera_of_a_pi_is_within_the_bound() -> None:
    assert MOST_PIXELS >= 9152 * 6944
    wire.decode(CompressedImage, wire.encode(CompressedImage(data=jpeg(9152, 6944))))


@pytest.mark.parametrize("data", [b"", b"x", b"II*\x00" + bytes(40), png(60_000)])
def test_a_picture_that_is_not_unpacked_is_left_out(data: bytes) -> None:
    message = frames.image(data, stamp_ns=1)
    item = Recorded("camera/image", payload=b"", message=message, publish_ns=1, log_ns=1)
    assert list(SimulatedPicture().take(item)) == []


@pytest.mark.parametrize("name", ["a.png", "a.bmp"])
def test_pictures_of_ones_own_are_refused_in_a_sentence(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A BMP tells no size here; OpenCV refuses more than 2^30 pixels by an error of its own."""
    bitmap = b"BM" + struct.pack("<IIIIiiHHIIiiII", 0, 0, 54, 40, 60_000, 60_000, 1, 24, 0, 0, 0, 0, 0, 0)
    path = tmp_path / name
    path.write_bytes(png(60_000) if name == "a.png" else bitmap)
    assert pi_agent(["track", str(path)]) != 0
    assert "expected a picture" in capsys.readouterr().err
    with pytest.raises(UserError, match="Expected a picture"):
        next(open_pictures(tmp_path)[0])()


def test_a_picture_that_cannot_be_read_is_refused_in_a_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A test that runs as root may read every file, so that the refusal is made up."""

    def refused(_: Path) -> bytes:
        raise PermissionError(errno.EACCES, "Permission denied")

    path = tmp_path / "a.png"
    path.write_bytes(png(10))
    monkeypatch.setattr(Path, "read_bytes", refused)
    with pytest.raises(UserError, match="but it cannot be read: Permission denied"):
        next(open_pictures(tmp_path)[0])()
    assert pi_agent(["track", str(path)]) == 2
    assert "expected a picture, but it cannot be read" in capsys.readouterr().err
