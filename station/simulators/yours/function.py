"""The function in a user's file, and one call of it: what goes wrong becomes one sentence."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from shared.errors import UserError
from shared.own_module import module_in
from station.physics.model import Model
from station.simulators.planar.commands import Commands
from station.simulators.planar.plate import Plate
from station.simulators.yours.answer import Answer, answer_of
from station.simulators.yours.found import Found
from station.simulators.yours.run import run_of

NAMED = "simulate"
"""The function that is called where none is named."""
Function = Callable[..., Any]


def loaded(path: Path, name: str = NAMED) -> Function:
    """Returns the function of that name in a Python file, whose neighbours it can import.

    Raises:
        UserError: if the file cannot be read or run, or has no such function.
    """
    if not path.is_file():
        raise UserError(f"Expected a Python file with a simulator at {path}, found none")
    sys.path.insert(0, str(path.resolve().parent))
    try:
        module = module_in(path, name=path.stem)
    except BaseException as error:
        raise UserError(f"Expected {path} to define a simulator, but importing it failed: {one_line(error)}") from error
    function = getattr(module, name, None)
    if not callable(function):
        raise UserError(f"Expected a function {name} in {path}, found none; name another one as {path}:FUNCTION")
    return function


def takes_found(function: Function) -> bool:
    """Returns true if the function has a second argument, for what was found."""
    try:
        inspect.signature(function).bind(None, None)
    except (TypeError, ValueError):
        return False
    return True


def called(function: Function, commands: Commands, model: Model, friction: float) -> Answer:
    """Simulates one run: `commands` has a single row; `friction` is this run's own factor on it.

    Raises:
        UserError: with the run and what the function did wrong.
    """
    run = run_of(Plate(commands, model))
    found = (Found(model, commands, friction=friction),) if takes_found(function) else ()
    try:
        with np.errstate(all="ignore"):
            given = function(run, *found)
    except (KeyboardInterrupt, GeneratorExit):
        raise
    except BaseException as error:
        raise UserError(f"it raised {one_line(error)}") from error
    try:
        return answer_of(given, run)
    except ValueError as error:
        raise UserError(str(error)) from error


def one_line(error: BaseException) -> str:
    """Returns an exception in one line."""
    return f"{type(error).__name__}: {' '.join(str(error).split())}".rstrip(": ")
