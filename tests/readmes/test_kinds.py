"""A block whose kind no test here knows is an error, not a block that nobody reads."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from station.app.demonstration import PLAIN, reveal
from station.app.deploy.verify import Arrival
from station.app.planting import plant
from station.diagnosis.result import FitQuality, Quality, Value
from station.physics.catalogue import catalogue
from tests.readmes.blocks import BLOCK, ROOT, Block, blocks, blocks_of, pages
from tests.unit.app.test_demo import effect, found

KINDS = {"sh", "python", "sql", "toml", "text"}
"""Each has its test_KIND.py, `text` this file."""

FORMULAS = ("pi_agent/cameras/README.md", "station/angles/README.md", "station/friction/limit_curve/README.md")
NUMBER = r"[-+]?\d+\.?\d*"


def arrival() -> str:
    """The last line of `station deploy`."""
    come = Arrival(
        corners=2, found=2, rate_hz=9.5, p50_ms=1.5, p99_ms=2.5, offset_ms=0.5, sigma_ms=0.1, dropped=1, version="1",
        fault="",
    )  # fmt: skip
    return f"Verified: {come}"


def revealed() -> str:
    """The reveal of `station demo`."""
    known = catalogue()
    model = plant(["uneven_contact=0.0018"], PLAIN, known)
    sole = replace(effect("uneven_contact"), parameters={"x_m": Value(value=0.0018, sd=0.0001, unit="m")})
    quality = Quality(log_score=1.0, onset_rmse_deg=1.0, path_rmse_mm=1.0, coverage90=0.9, path_median_mm=3.91)
    fit = replace(FitQuality.unknown(), before=quality, after=replace(quality, path_median_mm=0.08))
    return "\n".join(reveal(model, replace(found(sole), fit=fit), known).lines)


def test_the_first_page_is_read_in_ten_minutes() -> None:
    """The pages of the folders hold what does not fit here."""
    assert len((ROOT / "README.md").read_text("utf-8").splitlines()) <= 150


def shown_of(block: Block) -> str:
    """The lines that are shown, without those that say that more is printed before or after them."""
    return block.text.strip().removeprefix("…").removesuffix("…").strip()


PRINTED = {"deploy/README.md": arrival, "README.md": revealed}


def printed() -> list[Block]:
    """The blocks of text that are no formulas, and no diagnosis: tests/recovery/test_rig_as_it_comes.py prints that."""
    return [block for block in blocks("text") if block.readme not in FORMULAS and not block.is_diagnosis]


@pytest.mark.parametrize("block", blocks(), ids=lambda block: f"{block.readme}-{block.language}")
def test_a_test_knows_its_kind(block: Block) -> None:
    assert block.language in KINDS, f"no test reads blocks of {block.language!r}, as in {block.readme}"


@pytest.mark.parametrize("block", printed(), ids=lambda block: block.readme)
def test_what_is_no_formula_is_printed_by_a_program(block: Block) -> None:
    """A program prints the words of these lines, with numbers of its own."""
    expected = re.sub(NUMBER, "0", PRINTED[block.readme]())
    assert expected.startswith(re.sub(NUMBER, "0", shown_of(block)))


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


@pytest.mark.parametrize("path", pages(), ids=lambda path: path.as_posix())
def test_every_test_that_a_page_names_is_there(path: Path) -> None:
    named = re.findall(r"\btests/[\w/]+\.py", path.read_text(encoding="utf-8"))
    assert [name for name in named if not (ROOT / name).is_file()] == []
