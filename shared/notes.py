"""Words the lines that tell what a reader has to know beside the answer, as what a simulated rig conceals."""

from __future__ import annotations


def note_line(note: str) -> str:
    """Returns the line for a note, wherever it is shown: a sentence with one full stop at its end."""
    return f"Note: {note.rstrip('.')}."
