"""The licence of a dataset: an identifier of the SPDX list, which its owner names."""

from __future__ import annotations

from dataclasses import dataclass

from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression

from shared.errors import UserError

_USUAL = "CC0-1.0, CC-BY-4.0, CC-BY-SA-4.0, ODbL-1.0"
_ON_HUGGING_FACE = {
    **{name: name.lower() for name in ("CC0-1.0", "CC-BY-4.0", "CC-BY-SA-4.0", "CC-BY-NC-4.0", "CC-BY-NC-SA-4.0")},
    **{name: name.lower() for name in ("CC-BY-ND-4.0", "CC-BY-NC-ND-4.0", "MIT", "Apache-2.0", "BSD-3-Clause")},
    **{"ODbL-1.0": "odbl", "ODC-By-1.0": "odc-by", "PDDL-1.0": "pddl", "CDLA-Permissive-2.0": "cdla-permissive-2.0"},
}
"""The names that Hugging Face has for them; it calls all others `other` (hub documentation, "Licenses")."""


@dataclass(frozen=True, kw_only=True)
class Licence:
    """A licence: `id` in the SPDX list's spelling."""

    id: str

    @property
    def url(self) -> str:
        """The page that has its text."""
        return f"https://spdx.org/licenses/{self.id}.html"

    def card_lines(self) -> tuple[str, ...]:
        """Returns the lines of a dataset card's header."""
        if self.id in _ON_HUGGING_FACE:
            return (f"license: {_ON_HUGGING_FACE[self.id]}",)
        return "license: other", f"license_name: {self.id.lower()}", f"license_link: {self.url}"


def licence(name: str | None) -> Licence:
    """Returns the licence of that name, in any case of its letters.

    Raises:
        UserError: if there is no name, or it is not one identifier of the SPDX list.
    """
    if not name:
        raise UserError(
            f"Expected --license with an SPDX identifier, because only the owner can give data away; usual are {_USUAL}"
        )
    try:
        found = str(canonicalize_license_expression(name))
    except InvalidLicenseExpression:
        found = ""
    if not found or " " in found or found.startswith("LicenseRef-"):
        raise UserError(
            f"Expected one identifier of the SPDX list (https://spdx.org/licenses) for --license, got '{name}'; "
            f"usual are {_USUAL}"
        )
    return Licence(id=found)
