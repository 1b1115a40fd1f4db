"""The pages of the reference, which lie in docs/reference so that they are read without the site as well."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from docs.make import effects, messages, plan, rig

FOLDER = Path(__file__).parents[1] / "reference"
PAGES: dict[str, Callable[[], str]] = {
    "messages.md": messages.page,
    "effects.md": effects.page,
    "rig.md": rig.page,
    "plan.md": plan.page,
}


def write() -> None:
    """Writes every page."""
    for name, page in PAGES.items():
        (FOLDER / name).write_text(page(), encoding="utf-8")
