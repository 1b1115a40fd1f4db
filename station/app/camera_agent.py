"""Objects of the camera agent that the station uses without knowing its code: by the package's entry points."""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import Any

from shared.errors import UserError


def borrowed(group: str, name: str, *, to: str) -> Any:
    """Returns the agent's object at an entry point; `to` says in an error what it is wanted for.

    Raises:
        UserError: if the camera agent is not installed here.
    """
    found = entry_points(group=group, name=name)
    if not found:
        raise UserError(
            f"Expected the camera agent installed beside the station {to} (entry point {group}: {name}); "
            "install the whole `repose-friction` package"
        )
    return next(iter(found)).load()
