"""Words name recordings: files, globs, folders and addresses, each once, or a sentence before any work."""

from __future__ import annotations

from pathlib import Path

import pytest

from shared.errors import UserError
from station.app.many.named import chosen, size_bytes


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name in ("a.mcap", "b.mcap", "b.csv", "note.txt", "deep/er/c.mcap", "deep/d.mcap.partial", "[x].mcap"):
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).write_bytes(b"12345")
    return tmp_path


@pytest.mark.parametrize(
    ("words", "names", "one"),
    [
        (["a.mcap"], ["a.mcap"], True),
        (["missing.mcap"], ["missing.mcap"], True),  # the command says so in its own words
        (["note.txt"], ["note.txt"], True),
        (["[x].mcap"], ["[x].mcap"], True),
        (["b.mcap", "a.mcap"], ["b.mcap", "a.mcap"], False),
        (["*.mcap"], ["[x].mcap", "a.mcap", "b.mcap"], False),
        (["b.*"], ["b.csv", "b.mcap"], False),
        (["a.mca[p]"], ["a.mcap"], False),
        (["deep"], ["deep/d.mcap.partial", "deep/er/c.mcap"], False),
        (["deep/**/*.mcap"], ["deep/er/c.mcap"], False),
        (["a.mcap", "*.mcap"], ["a.mcap", "[x].mcap", "b.mcap"], False),
        (["b.csv", "."], ["b.csv", "[x].mcap", "a.mcap", "b.mcap", "deep/d.mcap.partial", "deep/er/c.mcap"], False),
    ],
)
def test_words_name_recordings(words: list[str], names: list[str], one: bool) -> None:
    found = chosen(words)
    assert ([Path(name).as_posix() for name in found.names], found.one) == (names, one)


def test_who_takes_no_tables_gets_none() -> None:
    assert chosen(["b.*"], tables=False).names == ("b.mcap",)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["a.mcap", "missing.mcap"], "missing.mcap, but it cannot be read: No such file"),
        (["*.bag"], "found none"),
        (["a.mcap", "no*.mcap"], "no\\*.mcap, found none"),
    ],
)
def test_what_names_nothing_is_said_at_once(words: list[str], said: str) -> None:
    with pytest.raises(UserError, match=said):
        chosen(words)


def test_an_empty_folder_is_said_at_once() -> None:
    Path("empty").mkdir()
    with pytest.raises(UserError, match="at empty, found none"):
        chosen(["empty"])


def test_sizes_add_up_and_are_unknown_elsewhere() -> None:
    assert size_bytes(["a.mcap", "b.csv"]) == 10
    assert size_bytes(["a.mcap", "s3://bucket/a.mcap"]) is None
