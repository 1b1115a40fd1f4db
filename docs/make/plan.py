"""The reference of plan files."""

from __future__ import annotations

from docs.make.fields import heading
from docs.make.keys import tables
from station.sampling.plan import Plan


def page() -> str:
    """The whole page."""
    parts = [
        heading(1, "Plan files"),
        "Every key of plan.toml (`station run --plan plan.toml`), written from the classes that read it. The defaults "
        "are the paper's values. `station plan --separate` writes such a file.",
        *tables("", Plan),
    ]
    return "\n\n".join(parts) + "\n"
