"""Long work that is spread over processes, and results that are whole or not there."""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from rich.console import Console

from station.app.bars import bar
from station.pool import spread

Task = TypeVar("Task")


def work_on(tasks: Sequence[Task], work: Callable[[Task], None], *, jobs: int, title: str, console: Console) -> None:
    """Calls `work` on every task, in any order, with a bar; each call writes its own result, whole or not at all.

    Ctrl-C leaves the tasks at hand to the next call. Workers of a cluster see the same folders.
    """
    if not tasks:
        return
    with bar(console) as progress:
        shown = progress.add_task(title, total=len(tasks))
        try:
            with spread(work, tasks, jobs=jobs, in_order=False) as done:
                for _ in done:
                    progress.advance(shown)
        except BaseException:
            progress.console.print("Stopped; the same command goes on from here.")
            raise


def write_json(path: Path, value: Mapping[str, Any]) -> None:
    """Writes the whole file or nothing, so that a run that was broken off leaves no half of a result."""
    path.parent.mkdir(parents=True, exist_ok=True)
    writer = f"{os.getpid()}-{threading.get_ident()}"  # two may write the same
    partial = path.with_name(f"{path.name}.{writer}.partial")
    partial.write_text(json.dumps(value, indent=1) + "\n", encoding="utf-8")
    os.replace(partial, path)
