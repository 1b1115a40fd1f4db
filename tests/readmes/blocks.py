"""The code blocks of every page of the repository that is written in Markdown.

A block is fenced with its language's name, or indented by four spaces: then it holds lines of a shell. What is neither
(a formula, something that was printed) is fenced as `text`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from textwrap import dedent

ROOT = Path(__file__).parents[2]
FOLDERS = ("deploy", "pi_agent", "shared", "station", "tests")
FENCED = r"^ *(?P<fence>```+|~~~+) *(?P<language>[^\n`]*)\n(?P<fenced>.*?)^ *(?P=fence) *$"
INDENTED = r"(?P<indented>(?:^ {4,}\S[^\n]*\n)+)"
BLOCK = re.compile(f"{FENCED}|{INDENTED}", flags=re.DOTALL | re.MULTILINE)


@dataclass(frozen=True)
class Block:
    """One code block: its page's path from the root, its language, its text without the indentation."""

    readme: str
    language: str
    text: str

    @property
    def is_diagnosis(self) -> bool:
        """True for what `station diagnose` printed."""
        return self.language == "text" and "global p " in self.text

    def lines(self) -> list[str]:
        """The shell's lines, continued ones joined."""
        return [line.strip() for line in self.text.replace("\\\n", " ").splitlines() if line.strip()]


def pages() -> list[Path]:
    """README.md, the other pages beside it, and those of the folders."""
    beside = sorted(ROOT.glob("*.md"), key=lambda path: path.name != "README.md")
    return [*beside, *(path for name in FOLDERS for path in sorted((ROOT / name).rglob("*.md")))]


def blocks(language: str = "") -> list[Block]:
    """Every block, or those of a language, in the order in which they are read."""
    found = [
        block
        for path in pages()
        for block in blocks_of(path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8"))
    ]
    return [block for block in found if language in ("", block.language)]


def blocks_of(name: str, text: str) -> list[Block]:
    """The blocks of one page."""
    found: list[Block] = []
    for match in BLOCK.finditer(f"{text}\n"):
        language, fenced = match["language"], match["fenced"]
        found.append(Block(name, "sh", match["indented"]) if fenced is None else Block(name, language, dedent(fenced)))
    return found
