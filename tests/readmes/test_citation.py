"""CITATION.cff says of the project what its package does."""

from __future__ import annotations

import re
import tomllib

import pytest

from tests.readmes.blocks import ROOT


@pytest.mark.parametrize("key", ["version", "license"])
def test_it_cites_what_the_package_is(key: str) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    cited = re.search(rf"^{key}: (.+)$", (ROOT / "CITATION.cff").read_text("utf-8"), re.MULTILINE)
    assert cited
    assert cited[1] == project[key]


def test_the_first_page_tells_how_to_cite() -> None:
    assert "(CITATION.cff)" in (ROOT / "README.md").read_text("utf-8")
