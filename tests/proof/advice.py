"""Judges if the advised next experiment would split what could not be split.

The key says which features of a protocol would; the tool's plan and its reason say in words what to vary.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from tests.proof.key import Truth
from tests.proof.said import Said

WORDS: Mapping[str, str] = {
    "yaw": r"block turned|turn the block|block's yaw|\[yaw\]",
    "mounts": r"mount",
    "sensor": r"angle sensor|inclinometer|second sensor|IMU",
    "replace": r"designed starts|put the block back|starts spread|mirrored starts",
    "free": r'mode = "free"|free azimuths|directions drawn at random',
    "masses": r"\bmass(es)?\b|\bloads\b",
    "area": r"\barea\b|\bsole\b",
    "dwell": r"dwell",
    "rates": r"tilt rates?|rate_deg_s|slower and smoother",
    "low_speed": r"slow slides|fine tilt steps",
    "frame_rate": r"frame rate|frames a second|rate_hz",
}


def features(plan: Mapping[str, Any] | None) -> frozenset[str]:
    """Returns what the advised experiment varies, by its reason: its plan also has what was recorded."""
    if plan is None:
        return frozenset()
    return frozenset(name for name, words in WORDS.items() if re.search(words, str(plan["why"]), re.IGNORECASE))


def advice_right(truth: Truth, said: Said) -> bool:
    """True if the plan has all words of one of the key's entries."""
    varied = features(said.answer.get("next_experiment"))
    return any(set(words) <= varied for words in truth.next)


def reason_right(truth: Truth, said: Said) -> bool:
    """True if the concealed effect is said to be untestable, and what it takes is named."""
    told = " ".join(reason for name, reason in said.untestable.items() if name in truth.ids)
    varied = features({"plan": "", "why": told}) if told else frozenset[str]()
    return any(set(words) <= varied for words in truth.next)
