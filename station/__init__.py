"""The laptop's side of Repose, from Python: open a recording, diagnose it, simulate it again, analyse its friction.

    recording = station.open("session.mcap")
    recording.samples.to_pandas()
    station.diagnose(recording)

`__all__` is the public interface; station/README.md has a page on it. A name is imported when it is first used, so that
`import station` takes no time.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from shared.errors import UserError
    from station.app.front.analysis import Analysed, analyze
    from station.app.front.diagnosis import Diagnosed, diagnose
    from station.app.front.recording import Recording, open
    from station.app.front.simulation import Simulated, simulate
    from station.app.front.table import Table

__all__ = [
    "Analysed",
    "Diagnosed",
    "Recording",
    "Simulated",
    "Table",
    "UserError",
    "analyze",
    "diagnose",
    "open",
    "simulate",
]

_HOMES = {
    "Analysed": "station.app.front.analysis",
    "Diagnosed": "station.app.front.diagnosis",
    "Recording": "station.app.front.recording",
    "Simulated": "station.app.front.simulation",
    "Table": "station.app.front.table",
    "UserError": "shared.errors",
    "analyze": "station.app.front.analysis",
    "diagnose": "station.app.front.diagnosis",
    "open": "station.app.front.recording",
    "simulate": "station.app.front.simulation",
}


def __getattr__(name: str) -> Any:
    """Returns the public name, imported now.

    Raises:
        UserError: if a package is not installed that an extra would bring.
    """
    if name not in _HOMES:
        raise AttributeError(f"module 'station' has no attribute {name!r}")
    from shared.installed import missing_as_user_error  # noqa: PLC0415  # `import station` takes no time

    with missing_as_user_error():
        value = getattr(importlib.import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
