"""The printed words are told from their numbers: another processor's may differ in their last digits."""

from __future__ import annotations

import re

NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")


def without_numbers(text: str) -> str:
    """The text in one line, with the same mark in the place of each number."""
    return re.sub(r"[-+\d.]+", "0", " ".join(text.split()))


def numbers_of(text: str) -> list[float]:
    """The numbers of a text in their order."""
    return [float(number) for number in NUMBER.findall(text)]
