"""The citation of a dataset as a Citation File Format file (https://citation-file-format.github.io, 1.2.0)."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass

from shared.errors import UserError
from station.publish.licence import Licence


@dataclass(frozen=True, kw_only=True)
class Author:
    """Somebody who made the dataset; an institution has no given names."""

    family: str
    given: str = ""

    @property
    def name(self) -> str:
        """The name as it is read."""
        return f"{self.given} {self.family}".strip()


def author(text: str) -> Author:
    """Returns the author of "Family, Given", or an institution.

    Raises:
        UserError: if there is no name.
    """
    family, _, given = (part.strip() for part in text.partition(","))
    if not family:
        raise UserError(f"Expected --author 'Family, Given' or the name of an institution, got '{text}'")
    return Author(family=family, given=given)


def citation(*, title: str, authors: Sequence[Author], licence: Licence, version: str) -> str:
    """Returns the text of CITATION.cff; `version` is that of Repose."""
    lines = [
        "cff-version: 1.2.0",
        "message: If you use this dataset, please cite it as below.",
        "type: dataset",
        f"title: {quoted(title)}",
        "authors:",
        *(line for one in authors for line in _lines_of(one)),
        f"license: {licence.id}",
        "references:",
        "  - type: software",
        "    title: Repose",
        f"    version: {quoted(version)}",
        "    authors:",
        "      - name: the Repose authors",
        "  - type: article",
        "    title: Automated Acquisition of Anisotropic Friction",
        "    authors:",
        "      - family-names: Dressel",
    ]
    return "\n".join(lines) + "\n"


def _lines_of(one: Author) -> tuple[str, ...]:
    if not one.given:
        return (f"  - name: {quoted(one.family)}",)
    return f"  - family-names: {quoted(one.family)}", f"    given-names: {quoted(one.given)}"


def quoted(text: str) -> str:
    """Returns a text for YAML, of which JSON is a part."""
    return json.dumps(text, ensure_ascii=False)
