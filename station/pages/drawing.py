"""The style of the reports' figures, their form as a part of a page, and as files."""

from __future__ import annotations

import io
import re
from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from shared.errors import UserError

BEFORE, AFTER, FLOOR, MARKED = "#999999", "#0072b2", "#009e73", "#d55e00"
"""Colours of the plain model, the found model, the repeatability floor and what stands out; the colour-blind can tell
them apart (Okabe, Ito)."""

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Colours of the same set for what has no meaning of its own, such as sensors beside each other."""

MOST_DOTS = 1500
"""A scatter of more points becomes a bitmap inside the drawing: as vectors it would take megabytes."""

_STYLE: dict[str, Any] = {
    "font.family": "sans-serif",
    "font.size": 9.0,
    "axes.titlesize": 10.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "lines.linewidth": 1.2,
    "pdf.fonttype": 42,  # fonts that can be edited
    "svg.fonttype": "none",  # text stays text: it can be searched, and the file is small
    "svg.hashsalt": "station",  # the same figure gives the same bytes
}

_folder: ContextVar[Path | None] = ContextVar("folder", default=None)


def style() -> Any:
    """The matplotlib context in which figures are drawn and saved."""
    return mpl.rc_context(_STYLE)  # pyright: ignore[reportArgumentType]  # its keys are typed as literals


def new_figure(*, width_in: float = 9.0, height_in: float = 3.2) -> Any:
    """An empty figure."""
    return Figure(figsize=(width_in, height_in), layout="constrained", facecolor="white")


@contextmanager
def kept_in(folder: Path | None) -> Generator[None]:
    """Has every figure of a page written into the folder as well, as NAME.svg and NAME.pdf; None: nowhere."""
    before = _folder.set(folder)
    try:
        yield
    finally:
        _folder.reset(before)


def _keep(figure: Any, folder: Path, name: str) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        figure.savefig(folder / f"{name}.svg", metadata={"Date": None, "Creator": None})
        figure.savefig(folder / f"{name}.pdf", metadata={"CreationDate": None})
    except OSError as error:
        raise UserError(f"Expected to write figures into {folder}, but that failed: {error.strerror}") from error


def inline_svg(figure: Any, *, name: str, alt: str) -> str:
    """The figure as an <svg> element with ids of its own and `alt` as its text for screen readers.

    Raises:
        UserError: if it is to be kept in a folder (`kept_in`) that cannot be written to.
    """
    if (folder := _folder.get()) is not None:
        _keep(figure, folder, name)
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    drawing = text.getvalue()
    drawing = drawing[drawing.index("<svg") :]
    drawing = _own_ids(drawing, name)
    drawing = re.sub(r"url\(#", f"url(#{name}-", drawing)
    drawing = re.sub(r'href="#', f'href="#{name}-', drawing)
    drawing = re.sub(r"<metadata>.*?</metadata>", "", drawing, flags=re.DOTALL)
    return drawing.replace("<svg ", f'<svg role="img" aria-label="{alt}" ', 1)


def _own_ids(drawing: str, name: str) -> str:
    """The drawing with `name` before each id; matplotlib repeats equal markers' ids, of which only the first stays."""
    seen: set[str] = set()

    def renamed(match: re.Match[str]) -> str:
        known = match[1] in seen
        seen.add(match[1])
        return "" if known else f' id="{name}-{match[1]}"'

    return re.sub(r'\sid="([^"]*)"', renamed, drawing)
