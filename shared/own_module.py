"""Python files of the user's own, run as modules. Only the command line and the user's own rig file name such files."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType


def module_in(file: Path, *, name: str) -> ModuleType:
    """Returns the module that running a file makes, known by that name to what looks it up, such as dataclasses.

    Raises:
        FileNotFoundError: if there is no such Python file.
        BaseException: whatever the file raises.
    """
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None or not file.is_file():
        raise FileNotFoundError(f"no Python file at {file}")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module
