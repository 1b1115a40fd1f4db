"""A note is worded in one place, and is one sentence wherever it is shown."""

from __future__ import annotations

from pathlib import Path

from shared.notes import note_line

ROOT = Path(__file__).parents[2]
PLACE = ROOT / "shared" / "notes.py"


def test_a_note_is_a_sentence_with_one_full_stop() -> None:
    assert note_line("the rig is a simulation") == "Note: the rig is a simulation."
    assert note_line("The clock will be stepped.") == "Note: The clock will be stepped."


def test_no_other_place_words_a_note() -> None:
    sources = [path for folder in ("shared", "station", "pi_agent") for path in (ROOT / folder).rglob("*.[pj][ys]")]
    assert PLACE in sources
    others = [path for path in sources if path != PLACE and "Note: " in path.read_text(encoding="utf-8")]
    assert others == []
