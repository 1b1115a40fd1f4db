"""A matplotlib figure as an element of a page."""

from __future__ import annotations

import io
import re
from html import escape
from typing import Any


def inline(figure: Any, *, name: str, alt: str) -> str:
    """Returns the figure as an <svg> element with ids of its own and `alt` as its text for screen readers."""
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    drawing = text.getvalue()
    drawing = drawing[drawing.index("<svg") :]
    drawing = _own_ids(drawing, name)
    drawing = re.sub(r"url\(#", f"url(#{name}-", drawing)
    drawing = re.sub(r'href="#', f'href="#{name}-', drawing)
    drawing = re.sub(r"<metadata>.*?</metadata>", "", drawing, flags=re.DOTALL)
    return drawing.replace("<svg ", f'<svg role="img" aria-label="{escape(alt)}" ', 1)


def _own_ids(drawing: str, name: str) -> str:
    """Returns the drawing with `name` before each id.

    Matplotlib repeats the ids of equal markers, of which only the first stays.
    """
    seen: set[str] = set()

    def renamed(match: re.Match[str]) -> str:
        known = match[1] in seen
        seen.add(match[1])
        return "" if known else f' id="{name}-{match[1]}"'

    return re.sub(r'\sid="([^"]*)"', renamed, drawing)
