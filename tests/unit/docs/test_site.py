"""The documentation site: a reference as new as the code, links that lead somewhere, a tutorial that can be run."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

import station
from docs.make import guide, reference
from docs.make.keys import explained_in
from shared import topics, wire
from shared.rig import RigConfig
from station.physics.catalogue import catalogue
from tests.unit.deploy.test_rig_example import EXAMPLE

SITE: dict[str, Any] = YAML(typ="safe", pure=True).load((guide.ROOT / "docs/mkdocs.yml").read_text("utf-8"))
TUTORIAL: dict[str, Any] = json.loads((guide.ROOT / "docs/tutorial.ipynb").read_text("utf-8"))


@pytest.mark.parametrize("name", reference.PAGES)
def test_a_page_of_the_reference_is_as_new_as_the_code(name: str) -> None:
    written = (reference.FOLDER / name).read_text("utf-8")
    assert written == reference.PAGES[name](), "the code has changed; run: make reference"


def test_every_topic_message_effect_and_table_is_in_the_reference() -> None:
    pages = {name: (reference.FOLDER / name).read_text("utf-8") for name in reference.PAGES}
    for line in topics.TOPICS.values():
        assert f"| `{line.name}` |" in pages["messages.md"]
        assert f"### {wire.schema_name(line.message)}\n" in pages["messages.md"]
    for effect in catalogue().values():
        assert f"### {effect.id}\n" in pages["effects.md"]
        assert all(f"| `{one.name}` |" in pages["effects.md"] for one in effect.parameters)
    for table in set(RigConfig.__dataclass_fields__) - {"id", "planted", "text"}:
        assert f"### [{table}" in pages["rig.md"]


def test_every_key_of_the_example_is_in_the_reference_with_its_meaning() -> None:
    page = (reference.FOLDER / "rig.md").read_text("utf-8")
    keys = explained_in(EXAMPLE.read_text("utf-8"))
    assert keys["camera.rate_hz"].startswith("wanted")
    assert len(keys) > 80
    for key in keys:
        assert f"| `{key.rpartition('.')[2]}` |" in page, key


def test_a_comment_is_found_behind_a_text_with_its_sign_in_it() -> None:
    assert explained_in('[a]\nb = "#1"  # a colour\nc = ["#"]   # colours\n') == {"a.b": "a colour", "a.c": "colours"}


def test_no_link_of_the_guide_leads_out_of_it(tmp_path: Path) -> None:
    folder = tmp_path / "pages"
    guide.stage(folder)
    found = 0
    for page in folder.rglob("*.md"):
        for target in re.findall(r"\]\(([^)\s#:]+)(?:#[^)\s]*)?\)", _without_code(page.read_text("utf-8"))):
            assert (page.parent / target).is_file(), f"{page.relative_to(folder)} links to {target}"
            found += 1
    assert found > 40
    assert not list(folder.rglob("*.mcap"))


def _without_code(text: str) -> str:
    return re.sub(r"```.*?```|`[^`\n]*`", "", text, flags=re.DOTALL)


def test_a_link_to_a_folder_leads_to_its_page_and_one_to_nothing_is_words() -> None:
    text, files = guide.linking(Path("ARCHITECTURE.md"))
    assert "[station/physics](station/physics/README.md)" in text
    assert Path("shared/messages.py") in files


def test_the_navigation_names_pages_that_are_there_and_every_page_of_the_reference() -> None:
    named = set(_pages_of(SITE["nav"]))
    assert all((guide.ROOT / page).is_file() for page in named)
    assert {f"docs/reference/{name}" for name in reference.PAGES} <= named


def _pages_of(nav: Any) -> Iterator[str]:
    if isinstance(nav, str):
        yield nav
    for inner in nav if isinstance(nav, list) else nav.values() if isinstance(nav, dict) else ():
        yield from _pages_of(inner)


def test_the_tutorial_holds_no_old_outputs_and_calls_what_there_is() -> None:
    """It is run when the site is built, which takes fifteen seconds of a processor."""
    cells = [cell for cell in TUTORIAL["cells"] if cell["cell_type"] == "code"]
    assert not any(cell["outputs"] or cell["execution_count"] for cell in cells)
    tree = ast.parse("\n".join("".join(cell["source"]) for cell in cells))
    used = {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute) and _is_station(node.value)}
    assert used >= {"open", "diagnose", "simulate"}
    assert used <= set(station.__all__)


def _is_station(node: ast.expr) -> bool:
    return isinstance(node, ast.Name) and node.id == "station"
