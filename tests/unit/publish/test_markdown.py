"""Names in Markdown: whatever a recording calls its object, the page shows it as it is."""

from __future__ import annotations

from typing import Any
from unittest.mock import Mock

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from markdown_it import MarkdownIt  # rich depends on it

from shared.visible import visible
from station.pages.markdown import inline, row
from station.publish.card import Card
from station.publish.citation import Author
from station.publish.licence import Licence
from station.publish.source import Source

_MARKDOWN = MarkdownIt("commonmark").enable(["table", "strikethrough"])
_NASTY = 'x"\n---\nlicense: mit\n<img src=x onerror=alert(1)> [click](javascript:alert(1))'
_TEXTS = st.text(st.characters(codec="utf-8")) | st.from_regex(
    r"[0-9]{0,2}[-+=.)*#>~`|!&<\[\]:$_\\ ]{1,4}[a-z;/]{0,3}( \|)?[-=]{0,3}", fullmatch=True
)


def shown(text: str) -> list[str]:
    """Returns the kinds of blocks in a text, and what each paragraph, heading or cell shows without any markup."""
    found = list[str]()
    for token in _MARKDOWN.parse(text):
        if token.type != "inline":
            found.append(token.type)
            continue
        assert {child.type for child in token.children or ()} <= {"text"}, token.content
        found.append("".join(child.content for child in token.children or ()))
    return found


@pytest.mark.parametrize("before", ["# ", "- ", ""], ids=["heading", "item", "sentence"])
@settings(deadline=None)
@given(text=_TEXTS)
def test_a_text_is_shown_as_it_is(text: str, before: str) -> None:
    plain = " ".join(text.split())
    expected = [kind if kind != "x" else visible(plain) for kind in shown(f"{before}x")]
    if plain:
        assert shown(before + inline(text)) == expected


@settings(deadline=None)
@given(text=_TEXTS)
def test_a_cell_is_shown_as_it_is(text: str) -> None:
    head, plain = "| a | b |\n|---|---|\n", " ".join(text.split())
    expected = [kind if kind != "x" else visible(plain) for kind in shown(head + row(("x", "end")))]
    assert shown(head + row((text, "end"))) == expected


def _source(**given: Any) -> Source:
    told = {"name": "a.mcap", "rig": "r", "mode": "", "started": "", "digest": "d", "sha256": "s", "session": "s"}
    return Source(reader=Mock(topics=()), seed=None, versions={}, samples=(), **{**told, **given})


def _card(text: str) -> str:
    return Card(
        title=text,
        authors=(Author(family=text),),
        licence=Licence(id="CC-BY-4.0"),
        sources=(_source(rig=text, mode=text),),
        figures=("figures/a.png",),
        pairs={text: (f"The angle of {text} is 20°.",)},
        version="1",
    ).text()


def test_nothing_in_a_name_is_a_part_of_the_card() -> None:
    """A name began a second header with another licence, an image and a link that ran a script."""
    parsed, plain = (
        [token.type for token in _MARKDOWN.parse(text.split("---\n", 2)[2])] for text in map(_card, (_NASTY, "steel"))
    )
    assert parsed == plain
    html = _MARKDOWN.render(_card(_NASTY).split("---\n", 2)[2])
    assert "<img src=x" not in html
    assert 'href="javascript' not in html
    assert "\nlicense: mit" not in _card(_NASTY)
