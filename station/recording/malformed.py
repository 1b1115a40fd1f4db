"""Words on payloads that are no message of their topic: every reader leaves them out, and says how many they were."""

from __future__ import annotations

from collections.abc import Mapping


def counted(malformed: Mapping[str, int]) -> str:
    """The numbers of such payloads by topic, as in '3 on /session/sample, 1 on /clock'."""
    return ", ".join(f"{count} on /{topic}" for topic, count in sorted(malformed.items()))


def left_out(malformed: Mapping[str, int]) -> str:
    """A sentence on what was left out; empty if nothing was."""
    if not malformed:
        return ""
    return f"Left out: {counted(malformed)}, which are no messages of their topic, or have times that no message has."
