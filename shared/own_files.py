"""Secrets in files: what others than their owner may read or write is refused in words."""

from __future__ import annotations

from pathlib import Path

from shared.errors import UserError
from shared.system.files import open_to_others, writable_by_others


def require_secret(path: Path, *, what: str) -> None:
    """Refuses a secret, which a sentence calls `what` ("a private key"), if others may read or write it.

    Raises:
        UserError: if others than its owner may.
        OSError: if there is no such file.
    """
    if open_to_others(path):
        raise UserError(f"Expected {what} that its owner alone can read, got {path}: chmod 600 it")


def require_own(*paths: Path, what: str) -> None:
    """Refuses secrets (`what` is their name in a sentence), or their folders, to which others may write.

    Raises:
        UserError: if others than its owner may write to one of them.
        OSError: if one of them does not exist.
    """
    for path in paths:
        if writable_by_others(path):
            raise UserError(f"Expected {what} that their owner alone can write to, got {path}: chmod go-w it")
