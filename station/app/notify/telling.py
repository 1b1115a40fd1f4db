"""The part of a session that tells somebody: thread and watch together, and at the end the failures that are left."""

from __future__ import annotations

import time
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console

from shared.rig import RigConfig
from station.app.notify.notifier import Notifier
from station.app.notify.watch import Watch
from station.sampling.plan import Plan


@contextmanager
def telling(rig: RigConfig, plan: Plan, path: Path, *, where: Console) -> Generator[Watch]:
    """Provides the watch over a session that is recorded to `path`; failures at its very end are printed on `where`.

    A rig that names nobody has one as well, which is silent and has no thread. A session that an unforeseen error ends
    is told of, too.
    """
    notifier = Notifier(rig.notify, seconds=time.monotonic)
    watch = Watch(notifier, rig.notify, rig_id=rig.id, recording=path.name, planned=plan.samples, now=time.time_ns)
    try:
        yield watch
    except Exception as error:
        watch.broke_off(error)
        raise
    finally:
        notifier.close()
        for failure in notifier.failures():
            where.print(f"Notify: {failure}", markup=False)
