"""The documentation site: a reference as new as the code, links that lead somewhere, a tutorial that can be run."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib import pyplot
from ruamel.yaml import YAML

import station
from docs.make import guide, reference
from docs.make.keys import explained_in
from shared import topics, wire
from shared.rig import RigConfig
from station.physics.catalogue import catalogue
from tests.patience import PATIENCE_S
from tests.unit.deploy.test_rig_example import EXAMPLE

SITE: dict[str, Any] = YAML(typ="safe", pure=True).load((guide.ROOT / "docs/mkdocs.yml").read_text("utf-8"))
TUTORIAL: dict[str, Any] = json.loads((guide.ROOT / "docs/tutorial.ipynb").read_text("utf-8"))
CELLS = [cell for cell in TUTORIAL["cells"] if cell["cell_type"] == "code"]


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


def test_a_list_below_a_paragraph_is_a_list_on_the_site_too() -> None:
    text, _ = guide.linking(Path("station/export/README.md"))
    assert "What these depend on:\n\n- **MuJoCo**" in text
    assert "\n\n- **Bullet**" not in text, "the items of one list stay together"


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
    assert not any(cell["outputs"] or cell["execution_count"] for cell in CELLS)
    tree = ast.parse("\n".join("".join(cell["source"]) for cell in CELLS))
    used = {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute) and _is_station(node.value)}
    assert used >= {"open", "diagnose", "simulate"}
    assert used <= set(station.__all__)


def test_the_tutorial_runs_from_a_recording_to_a_better_simulation(capsys: pytest.CaptureFixture[str]) -> None:
    pyplot.switch_backend("Agg")
    told: dict[str, Any] = {"__name__": "tutorial"}
    for cell in CELLS:
        exec(compile("".join(cell["source"]), "tutorial.ipynb", "exec"), told)
    pyplot.close("all")
    away_mm = {name: np.median(np.abs(told["seen_mm"][name] - told["seen_mm"]["recorded"])) for name in told["seen_mm"]}
    assert away_mm["improved"] < 0.2 * away_mm["plain"]
    assert "sag" in str(told["answer"]), "what the page says of it"
    assert (told["folder"] / "model.toml").read_text("utf-8") in capsys.readouterr().out
    assert len(station.open(told["folder"] / "again.mcap").samples["run"]) > 10


def test_the_site_runs_the_tutorial_and_no_other_file() -> None:
    """A page may link to a .py file, which is then beside it, and which mkdocs-jupyter takes for a notebook."""
    (notebooks,) = [plugin["mkdocs-jupyter"] for plugin in SITE["plugins"] if "mkdocs-jupyter" in plugin]
    assert (notebooks["include"], notebooks["execute"]) == (["docs/tutorial.ipynb"], True)


def test_the_whole_site_can_be_built(tmp_path: Path) -> None:
    """The site is built as `make docs` builds it, but for the tutorial, which the test above runs."""
    pytest.importorskip("mkdocs_jupyter", reason="what builds the site is not installed (the dependency group docs)")
    guide.stage(tmp_path / "pages")
    text = (guide.ROOT / "docs/mkdocs.yml").read_text("utf-8").replace("execute: true", "execute: false")
    config = tmp_path / "mkdocs.yml"
    config.write_text(text.replace("../build/docs/", ""), encoding="utf-8")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--config-file", str(config)]
    ended = subprocess.run(command, capture_output=True, text=True, check=False, timeout=PATIENCE_S)
    assert ended.returncode == 0, ended.stderr
    assert "Diagnose" in (tmp_path / "site/docs/tutorial.html").read_text("utf-8")


def _is_station(node: ast.expr) -> bool:
    return isinstance(node, ast.Name) and node.id == "station"
