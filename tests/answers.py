"""Answers that take long: each is found once in a run of the tests, by whichever of its processes asks first.

A diagnosis of one recording is looked at by tests of several files, and files run in several processes. They keep their
answers in a folder that begins with the run and belongs to it alone, so that no answer outlives the code that gave it.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

FOLDER = "REPOSE_TESTS_ANSWERS"
"""The environment's name for the folder; without it each process finds its own answers."""

Answer = TypeVar("Answer")

_KNOWN = dict[str, Any]()
"""Answers by the digest of what was asked; they are kept, so that asking again gives the same object."""


def once(asked: object, answer: Callable[[], Answer]) -> Answer:
    """Returns what `answer` computes, or what it gave when the same was `asked`, which must name all that it takes."""
    import joblib  # noqa: PLC0415  # the agent's tests run where it is not installed

    digest = joblib.hash(asked)
    assert digest is not None
    if digest not in _KNOWN:
        folder = os.environ.get(FOLDER)
        _KNOWN[digest] = _kept(Path(folder) / digest, answer) if folder else answer()
    return _KNOWN[digest]


def _kept(file: Path, answer: Callable[[], Answer]) -> Answer:
    """Returns what the file holds; who comes first computes it, and the others wait, which leaves him their core."""
    import cloudpickle  # noqa: PLC0415  # as above; joblib brings it

    with _alone(file.with_suffix(".lock")):
        if not file.exists():
            part = file.with_suffix(f".{os.getpid()}.part")
            part.write_bytes(cloudpickle.dumps(answer()))
            part.replace(file)
    return cloudpickle.loads(file.read_bytes())


@contextmanager
def _alone(path: Path) -> Generator[None]:
    """Holds a lock that ends with its process; on Windows, which has none of that kind, all may compute the same."""
    with path.open("a") as file:
        if sys.platform != "win32":
            import fcntl  # noqa: PLC0415  # not on Windows

            fcntl.flock(file, fcntl.LOCK_EX)
        yield
