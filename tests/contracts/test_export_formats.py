"""Every export format that is found keeps its promises."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Sequence
from dataclasses import replace
from xml.etree import ElementTree

import pytest

from shared.csv_text import plain
from station.export import Format, export, export_formats
from station.export.exported import ExportedFile
from station.export.measured import MeasuredPair
from station.export.unsupported import always_unsupported
from tests.unit.export.pairs import PAIRS, WOOD_ON_WOOD

FORMATS = export_formats()
every_format = pytest.mark.parametrize("name", sorted(FORMATS))
HOSTILE = '--> <b>&"\'\\ \n é {x} %s """'
WHOLE = {"json", "csv"}
"""These have a place for everything, and need no sentence."""


def files(name: str, pairs: Sequence[MeasuredPair]) -> tuple[ExportedFile, ...]:
    return export(pairs, FORMATS[name])


def test_the_formats_that_were_asked_for_are_there():
    assert {"mujoco", "gazebo", "bullet", "drake", "usd", "json", "csv"} <= FORMATS.keys()


@every_format
def test_a_format_has_a_name_and_a_line_of_help(name: str):
    found: Format = FORMATS[name]
    assert name == found.NAME
    assert found.HELP
    assert "\n" not in found.HELP


@every_format
def test_every_pair_has_files_of_its_own_with_names_that_any_system_takes(name: str):
    twice = [*PAIRS.values(), replace(WOOD_ON_WOOD, object="Wood!"), replace(WOOD_ON_WOOD, object=HOSTILE)]
    names = [file.name for file in files(name, twice)]
    assert len(set(names)) == len(names) >= 1
    for each in names:
        assert re.fullmatch(r"[a-z][a-z0-9_]*(\.[a-z0-9]+)+", each)


@every_format
@pytest.mark.parametrize("pair", [*PAIRS.values(), replace(WOOD_ON_WOOD, object=HOSTILE, plate=HOSTILE)])
def test_the_files_are_well_formed(name: str, pair: MeasuredPair):
    for file in files(name, [pair]):
        match file.name.rsplit(".", 1)[-1]:
            case "xml" | "sdf" | "urdf":
                assert ElementTree.fromstring(file.text).tag in ("mujoco", "sdf", "robot")
            case "py":
                compile(file.text, file.name, "exec")
            case "json":
                assert json.loads(file.text)["pairs"][0]["object"] == pair.object
            case "csv":
                cell = next(csv.DictReader(io.StringIO(file.text)))["object"]
                assert plain(cell) == pair.object
                assert cell[:1] not in tuple("=+-@"), "a spreadsheet would run it"
            case _:
                assert file.text.startswith("#usda 1.0\n")


@every_format
def test_what_it_cannot_say_stands_in_the_file(name: str):
    for pair in PAIRS.values():
        for file in files(name, [pair]):
            if name in WHOLE:
                continue
            assert set(always_unsupported(pair)) <= set(file.unsupported)
            text = words(file.text)
            for sentence in file.unsupported:
                assert words(sentence) in text


def words(text: str) -> str:
    """Letters and figures alone: comments are broken into lines, with signs of their own."""
    return " ".join(re.findall(r"\w+", text))


@every_format
def test_the_numbers_of_the_measurement_stand_in_the_file(name: str):
    for pair in PAIRS.values():
        text = "\n".join(file.text for file in files(name, [pair]))
        for mu in (pair.mu_1, pair.mu_2):
            assert re.search(rf"\b{mu:.4f}\b|\b{mu:g}\b", text)


@every_format
def test_nothing_unknown_becomes_a_number(name: str):
    unknown = replace(PAIRS["steel_on_wood"], scatter=math.nan, kinetic_ratio=math.nan)
    for file in files(name, [unknown]):
        assert not re.search(r"\bnan\b|\bNaN\b|\binf\b", file.text)


@every_format
def test_of_runs_that_do_not_scatter_no_scatter_is_left_out(name: str):
    for file in files(name, [replace(PAIRS["steel_on_wood"], scatter=0.0)]):
        assert not [sentence for sentence in file.unsupported if "catter from run to run" in sentence]
