"""The code blocks of every README of the repository.

A block is fenced with its language's name, or indented by four spaces: then it holds lines of a shell. What is neither
(a formula, something that was printed) is fenced as `text`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDERS = ("deploy", "pi_agent", "shared", "station", "tests")


@dataclass(frozen=True)
class Block:
    """One code block: its README's path from the root, its language, its text without the indentation."""

    readme: str
    language: str
    text: str

    def lines(self) -> list[str]:
        """The shell's lines, continued ones joined."""
        return [line.strip() for line in self.text.replace("\\\n", " ").splitlines() if line.strip()]


def readmes() -> list[Path]:
    """README.md and those of the folders."""
    return [ROOT / "README.md", *(path for name in FOLDERS for path in sorted((ROOT / name).rglob("README.md")))]


def blocks(language: str = "") -> list[Block]:
    """Every block, or those of a language, in the order in which they are read."""
    found = [block for path in readmes() for block in _blocks_of(path)]
    return [block for block in found if language in ("", block.language)]


def _blocks_of(path: Path) -> list[Block]:
    text, name = path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix()
    found: list[Block] = []
    for fence in re.finditer(r"^```(\w*)\n(.*?)^```$|((?:^ {4,}\S[^\n]*\n)+)", text, flags=re.DOTALL | re.MULTILINE):
        language, fenced, indented = fence.groups()
        found.append(Block(name, language, fenced) if indented is None else Block(name, "sh", indented))
    return found
