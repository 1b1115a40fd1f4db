"""JSON of limit curves and friction pairs, as `station export` takes it."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

from station.friction.limit_curve.curve import LimitCurve
from tests.fuzz.change import of_table, of_text
from tests.fuzz.target import Target, command
from tests.unit.export.pairs import exported
from tests.unit.export.test_from_fit import ELLIPSE, fit


@cache
def _pairs() -> Any:
    with TemporaryDirectory() as folder:
        return json.loads((exported(Path(folder), "json") / "friction_pairs.json").read_text(encoding="utf-8"))


@cache
def _curves() -> Any:
    found = fit(LimitCurve(level=0.4, frame="plate", plate=ELLIPSE), "ellipse", mu_1=0.48, mu_2=0.32).as_dict()
    pair = {"object": "wood", "plate": "steel", "fit": found, "no_fit": ""}
    return {"pairs": [pair, {**pair, "fit": None, "no_fit": "Too few slides."}]}


def _json(random: Random, table: Any) -> bytes:
    if random.random() < 0.4:
        return of_text(random, json.dumps(table).encode())
    return json.dumps(of_table(random, table)).encode()


READ = command("export", "{file}", "--format", "json,csv,mujoco,gazebo", "--out", "exported", "--overwrite")

TARGETS = (
    Target("friction_pairs.json", ".json", lambda random: _json(random, _pairs()), READ),
    Target("limit_curves.json", ".json", lambda random: _json(random, _curves()), READ),
)
