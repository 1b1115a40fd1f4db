"""Files that a command is asked to write."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from shared.errors import UserError


def require_writable(path: Path, *, what: str) -> None:
    """Says at once that a result could not be written, where computing it takes minutes.

    Raises:
        UserError: if there can be no such file.
    """
    was_there = path.exists()
    try:
        path.open("ab").close()
        if not was_there:
            path.unlink()
    except OSError as error:
        raise _unwritable(path, what, error) from error


def write_text(path: Path, text: str, *, what: str) -> None:
    """Writes a text as UTF-8.

    Raises:
        UserError: if there can be no such file.
    """
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise _unwritable(path, what, error) from error


def without_nan(value: Any) -> Any:
    """Returns the value with None for every number that is not finite, at any depth: JSON has no NaN."""
    if isinstance(value, dict):
        return {key: without_nan(item) for key, item in value.items()}  # pyright: ignore[reportUnknownVariableType]
    if isinstance(value, list | tuple):
        return [without_nan(item) for item in value]  # pyright: ignore[reportUnknownVariableType]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _unwritable(path: Path, what: str, error: OSError) -> UserError:
    return UserError(f"Expected to write the {what} to {path}, but that failed: {error.strerror}")
