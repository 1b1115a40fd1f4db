"""A figure of a page: the drawing inside it, its caption below it, and the same as files."""

from __future__ import annotations

import base64
import io
from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar
from html import escape
from pathlib import Path
from typing import Any

from shared.errors import UserError
from station.pages.caption import Caption
from station.pages.svg import inline

_folder: ContextVar[Path | None] = ContextVar("folder", default=None)
DOTS_PER_INCH = 200
"""The resolution of bitmaps: a figure as wide as a page of paper is then as sharp as print."""


@contextmanager
def kept_in(folder: Path | None) -> Generator[None]:
    """Has every figure of a page written into the folder as well, as NAME.svg and NAME.pdf; None: nowhere."""
    before = _folder.set(folder)
    try:
        yield
    finally:
        _folder.reset(before)


def figure(drawing: str, caption: Caption) -> str:
    """Returns a drawing, which is HTML already, with its caption: every figure of every page is made here.

    On a narrow page the drawing scrolls, and its caption stays.
    """
    return f'<figure><div class="wide">{drawing}</div>{caption.html}</figure>'


def drawn(drawing: Any, caption: Caption, *, name: str, alt: str) -> str:
    """Returns a matplotlib figure as vectors inside the page; `name` is unique in it, `alt` is for screen readers.

    Raises:
        UserError: if it is to be kept in a folder (`kept_in`) that cannot be written to.
    """
    if (folder := _folder.get()) is not None:
        save(drawing, folder, name, caption)
    return figure(inline(drawing, name=name, alt=alt), caption)


def bitmap(png: bytes, caption: Caption, *, alt: str) -> str:
    """Returns a figure as the bytes of a PNG inside the page."""
    data = base64.b64encode(png).decode("ascii")
    return figure(f'<img src="data:image/png;base64,{data}" alt="{escape(alt)}">', caption)


def png_of(drawing: Any, caption: Caption) -> bytes:
    """Returns a matplotlib figure as the bytes of a PNG, with its caption in it."""
    made = io.BytesIO()
    drawing.savefig(made, format="png", metadata={"Description": caption.text}, dpi=DOTS_PER_INCH)
    return made.getvalue()


def save(drawing: Any, folder: Path, name: str, caption: Caption, *, png: bytes = b"") -> None:
    """Writes a matplotlib figure into the folder as NAME.svg and NAME.pdf, with its caption in each file.

    `png` is written beside them as NAME.png, if there is any.

    Raises:
        UserError: if the folder cannot be written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for kind in ("svg", "pdf"):
            write(drawing, folder / f"{name}.{kind}", caption)
        if png:
            (folder / f"{name}.png").write_bytes(png)
    except OSError as error:
        raise UserError(f"Expected to write figures into {folder}, but that failed: {error.strerror}") from error


def write(drawing: Any, path: Path, caption: Caption) -> None:
    """Writes a matplotlib figure with its caption in the file; the suffix says the kind.

    Raises:
        OSError: if it cannot be written.
        ValueError: for a kind that matplotlib does not know.
    """
    metadata = {word: caption.text if word in _CAPTIONS else None for word in _METADATA.get(path.suffix, ())}
    drawing.savefig(path, metadata=metadata or None, dpi=DOTS_PER_INCH)


_METADATA = {".svg": ("Description", "Date", "Creator"), ".pdf": ("Subject", "CreationDate"), ".png": ("Description",)}
"""A file tells neither its date nor the version of the program, so that equal data give equal files."""
_CAPTIONS = ("Description", "Subject")
