"""The folder of a dataset: new, and there as a whole or not at all."""

from __future__ import annotations

import os
import shutil
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from shared.errors import UserError

_GROWING = ".partial"


@contextmanager
def new_folder(path: Path) -> Generator[Path]:
    """Provides a folder to fill, which gets its name `path` at the end; after an error nothing is left of it.

    Raises:
        UserError: if there is something at `path` already, or it cannot be written to.
    """
    _refuse_taken(path)
    growing = path.with_name(path.name + _GROWING)
    try:
        growing.mkdir(parents=True)
    except FileExistsError as error:
        raise UserError(f"Expected room for {growing}, which an earlier run left behind; remove it") from error
    except OSError as error:
        raise UserError(f"Expected to write the dataset to {path}, but that failed: {error.strerror}") from error
    try:
        yield growing
        if path.is_dir():
            path.rmdir()  # it is empty, as was seen; if that has changed, this fails
        os.rename(growing, path)
    except OSError as error:
        raise UserError(f"Expected to write the dataset to {path}, but that failed: {error.strerror}") from error
    finally:
        shutil.rmtree(growing, ignore_errors=True)


def _refuse_taken(path: Path) -> None:
    if path.is_dir() and not any(path.iterdir()):
        return
    if path.exists():
        raise UserError(f"Expected a new folder for --out, but {path} exists; choose another one or move it away")
