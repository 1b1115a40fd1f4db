"""The licence that an owner names: spelt as SPDX does, known to Hugging Face or said to be another one."""

import pytest

from shared.errors import UserError
from station.publish.citation import author
from station.publish.licence import licence


def test_an_identifier_gets_the_spelling_of_the_list() -> None:
    assert licence("odbl-1.0").id == "ODbL-1.0"
    assert licence("odbl-1.0").card_lines() == ("license: odbl",)


def test_a_licence_that_hugging_face_does_not_list_is_another_with_its_page() -> None:
    lines = licence("CERN-OHL-P-2.0").card_lines()
    assert lines[:2] == ("license: other", "license_name: cern-ohl-p-2.0")
    assert lines[2].endswith("https://spdx.org/licenses/CERN-OHL-P-2.0.html")


@pytest.mark.parametrize("name", ["", None, "mine", "MIT OR CC0-1.0", "LicenseRef-Mine", "CC BY 4.0"])
def test_what_is_no_single_identifier_is_refused(name: str | None) -> None:
    with pytest.raises(UserError, match=r"CC-BY-4\.0"):
        licence(name)


def test_an_author_has_a_family_name_or_is_an_institution() -> None:
    assert author("Doe, Jo").name == "Jo Doe"
    assert author("Example Lab").name == "Example Lab"
    with pytest.raises(UserError, match="Family, Given"):
        author(" , Jo")
