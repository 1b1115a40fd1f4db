"""Terms without a name as tables of model.toml, and back.

    [[smooth]]                          # ln of the friction changes by 0.02 z − 0.01 z², z = (run − 75) / 135
    covariate = "run"
    at = ["onset", "sliding"]           # or one of the two
    powers = { middle = 75.0, spread = 135.0 }
    coefficients = [0.02, -0.01]

    [[smooth]]                          # of an angle
    covariate = "direction"
    at = ["onset"]
    harmonics = ["cos 1", "sin 1"]
    coefficients = [0.03, 0.0]

    [[smooth]]                          # a cosine and a sine that swing 2.5 times from `low` to `low + width`
    covariate = "run"
    at = ["onset", "sliding"]
    swings = { low = 0.0, width = 149.0, often = 2.5 }
    coefficients = [0.1, 0.05]

    [[smooth]]                          # a push in m/s² by the place: "radial", "linear", "any" or "field"
    covariate = "position"
    push = "radial"
    coefficients = [-0.2]

    [[smooth]]                          # a push in m/s² to the left of a sliding block's way
    covariate = "way"
    push = "aside"
    coefficients = [0.03]

A covariate that is not of the moment but of the run before has its values beside it, `runs = [1, 2]` and
`values = [0.5, -0.2]`: such a term can be simulated only in the session that it was found in.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from shared.errors import UserError
from station.physics.checked import number, numbers, only
from station.physics.covariates import READ
from station.physics.effect import Values
from station.physics.smooth import (
    PUSHES,
    WAVES,
    ByRun,
    Form,
    Harmonics,
    Powers,
    Push,
    Smooth,
    Swings,
    Unnamed,
    Wave,
    When,
    pushes,
)

_FORMS = ("powers", "harmonics", "swings")
_WHENS: tuple[When, ...] = ("onset", "sliding")
_WHERE = "[[smooth]]"
_HIGHEST = 12
"""The highest multiple of an angle: beyond it a wave is no longer smooth."""


def table_of_smooth(effect: Unnamed, values: Values) -> dict[str, Any]:
    """Returns the table of model.toml that describes the term."""
    coefficients = {"coefficients": [float(values[one.name]) for one in effect.parameters]}
    if isinstance(effect, Push):
        return {"covariate": effect.covariate, "push": effect.direction, **coefficients}
    if not isinstance(effect, Smooth):
        raise TypeError(f"no table for {type(effect).__name__}")
    table = {"covariate": effect.covariate, "at": sorted(effect.at), **_table_of_form(effect.form), **coefficients}
    if effect.by_run is not None:
        known = np.isfinite(effect.by_run.value)
        table["runs"] = [int(run) for run in effect.by_run.run[known]]
        table["values"] = effect.by_run.value[known].tolist()
    return table


def _table_of_form(form: Form) -> dict[str, Any]:
    match form:
        case Harmonics():
            return {"harmonics": [f"{wave} {k}" for wave, k in form.waves]}
        case Powers():
            return {"powers": {"middle": form.middle, "spread": form.spread}}
        case Swings():
            return {"swings": {"low": form.low, "width": form.width, "often": form.often}}
        case _:
            raise TypeError(f"no table for {type(form).__name__}")


def smooth_of_tables(tables: Any) -> list[tuple[Unnamed, dict[str, float]]]:
    """Returns the terms of all tables, with their values.

    Raises:
        UserError: saying in one sentence what was expected and what came.
    """
    if not isinstance(tables, list) or not all(isinstance(table, Mapping) for table in tables):
        raise UserError(f"Expected tables {_WHERE} in a model, got {tables!r}")
    found = [_term(table) for table in tables]  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]: what a parsed file holds
    ids = [effect.id for effect, _ in found]
    twice = next((name for number, name in enumerate(ids) if name in ids[:number]), None)
    if twice:
        raise UserError(f"Expected every {_WHERE} once, but {twice.partition(':')[2]!r} comes twice")
    return found


def _term(table: Mapping[str, Any]) -> tuple[Unnamed, dict[str, float]]:
    if "covariate" not in table or "coefficients" not in table:
        raise UserError(f"Expected covariate and coefficients in {_WHERE}, got {', '.join(table) or 'nothing'}")
    coefficients = numbers(table["coefficients"], f"coefficients of {_WHERE}")
    effect = _push(table) if "push" in table else _friction(table, len(coefficients))
    if len(coefficients) != len(effect.parameters):
        said = f"Expected {len(effect.parameters)} coefficients in {_WHERE} of {table['covariate']}"
        raise UserError(f"{said}, got {len(coefficients)}")
    for value, parameter in zip(coefficients, effect.parameters, strict=True):
        name = f"a coefficient of {_WHERE}"
        number(value, name, lambda one, of=parameter: of.low <= one <= of.high, parameter.expected)
    return effect, {one.name: value for one, value in zip(effect.parameters, coefficients, strict=True)}


def _push(table: Mapping[str, Any]) -> Unnamed:
    only(table, {"covariate", "push", "coefficients"}, f"{_WHERE} with a push")
    known: dict[tuple[object, object], Unnamed] = {(one.covariate, one.direction): one for one in pushes()}
    chosen = known.get((str(table["covariate"]), str(table["push"])))
    if chosen is None:
        said = f"push = {table['push']!r} by {table['covariate']!r}"
        raise UserError(f"Expected a push of {', '.join(PUSHES)} by position or aside by way in {_WHERE}, got {said}")
    return chosen


def _friction(table: Mapping[str, Any], size: int) -> Smooth:
    only(table, {"covariate", "at", "coefficients", "runs", "values", *_FORMS}, _WHERE)
    covariate = table["covariate"]
    forms = [name for name in _FORMS if name in table]
    if len(forms) != 1:
        raise UserError(f"Expected one of {', '.join(_FORMS)} in {_WHERE}, got {', '.join(forms) or 'none'}")
    form = _form(forms[0], table[forms[0]], size)
    if "runs" in table or "values" in table:
        return Smooth(str(covariate), form, at=_at(table), by_run=_by_run(table))
    if covariate not in READ:
        raise UserError(f"Expected one of {', '.join(READ)} as a covariate of {_WHERE}, got {covariate!r}")
    return Smooth(covariate, form, at=_at(table))


def _at(table: Mapping[str, Any]) -> frozenset[When]:
    said: Any = table.get("at", list(_WHENS))
    if not isinstance(said, list) or not said or not all(one in _WHENS for one in said):
        raise UserError(f"Expected one or both of {', '.join(_WHENS)} for at in {_WHERE}, got {said!r}")
    return frozenset(one for one in _WHENS if one in said)


def _form(name: str, table: Any, size: int) -> Form:
    if name == "harmonics":
        return Harmonics(waves=_waves(table))
    keys = ("middle", "spread") if name == "powers" else ("low", "width", "often")
    if not isinstance(table, Mapping) or set(table) != set(keys):
        raise UserError(f"Expected {', '.join(keys)} for {name} in {_WHERE}, got {table!r}")
    values = {key: number(table[key], f"{name}.{key} of {_WHERE}", math.isfinite, "a finite number") for key in keys}
    for key in keys[1:]:
        number(values[key], f"{name}.{key} of {_WHERE}", lambda value: value > 0, "a positive number")
    return Powers(**values, degree=max(size, 1)) if name == "powers" else Swings(**values)


def _waves(said: Any) -> tuple[tuple[Wave, int], ...]:
    known: dict[object, tuple[Wave, int]] = {f"{wave} {k}": (wave, k) for wave in WAVES for k in range(1, _HIGHEST + 1)}
    if not isinstance(said, list) or not said or not all(one in known for one in said):
        raise UserError(f'Expected harmonics such as ["cos 1", "sin 1"] in {_WHERE}, got {said!r}')
    return tuple(known[one] for one in said)


def _by_run(table: Mapping[str, Any]) -> ByRun:
    runs, values = (numbers(table.get(name), f"{name} of {_WHERE}") for name in ("runs", "values"))
    if len(runs) != len(values) or not runs:
        raise UserError(f"Expected as many runs as values in {_WHERE}, got {len(runs)} and {len(values)}")
    order = np.argsort(runs)
    return ByRun(np.array(runs)[order], np.array(values)[order])
