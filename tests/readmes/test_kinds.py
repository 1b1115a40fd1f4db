"""A block whose kind no test here knows is an error, not a block that nobody reads."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from station.app.deploy.verify import Arrival
from tests.readmes.blocks import BLOCK, Block, blocks, blocks_of, pages

KINDS = {"sh", "python", "toml", "text"}
"""Each has its test_KIND.py, `text` this file."""

FORMULAS = ("pi_agent/cameras/README.md", "station/angles/README.md", "station/friction/limit_curve/README.md")
NUMBER = r"[-+]?\d+\.?\d*"


@pytest.mark.parametrize("block", blocks(), ids=lambda block: f"{block.readme}-{block.language}")
def test_a_test_knows_its_kind(block: Block) -> None:
    assert block.language in KINDS, f"no test reads blocks of {block.language!r}, as in {block.readme}"


def test_what_is_no_formula_is_printed_by_a_program() -> None:
    """`station deploy` ends with the words of the line in the page, with numbers of its own."""
    (block,) = [block for block in blocks("text") if block.readme not in FORMULAS]
    printed = Arrival(
        corners=2, found=2, rate_hz=9.5, p50_ms=1.5, p99_ms=2.5, offset_ms=0.5, sigma_ms=0.1, dropped=1, version="1",
        fault="",
    )  # fmt: skip
    shown = block.text.strip().removeprefix("Verified: ").removesuffix(" …")
    assert re.sub(NUMBER, "0", str(printed)).startswith(re.sub(NUMBER, "0", shown))


@pytest.mark.parametrize(
    ("page", "kind", "text"),
    [
        ("```js\n1\n```\n", "js", "1\n"),
        ("- item\n  ```python\n  a\n    b\n  ```\nmore\n", "python", "a\n  b\n"),
        ("~~~\nplain\n~~~", "", "plain\n"),
        ("```{r}\n1\n```", "{r}", "1\n"),
        ("words\n\n    make run\n", "sh", "    make run\n"),
    ],
)
def test_no_form_of_a_block_is_overlooked(page: str, kind: str, text: str) -> None:
    assert blocks_of("page.md", page) == [Block("page.md", kind, text)]


@pytest.mark.parametrize("path", pages(), ids=lambda path: path.as_posix())
def test_every_fence_belongs_to_a_block(path: Path) -> None:
    beside_blocks = BLOCK.sub("", f"{path.read_text(encoding='utf-8')}\n")
    assert "```" not in beside_blocks
    assert "~~~" not in beside_blocks
