"""The guide: the repository's own pages in one folder, as they stand, with every link leading to something in it."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
_FOLDERS = ("deploy", "docs", "pi_agent", "shared", "station", "tests")
_LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s#]+)(#[^)\s]*)?\)")
_CODE = re.compile(r"(```.*?```|`[^`\n]*`)", re.DOTALL)
_LIST_BELOW = re.compile(r"^(?![\s#|>]|[-*] |\d+\. )(.+)\n(?=(?:[-*]|1\.) )", re.MULTILINE)
"""The last line of a paragraph that a list follows at once: GitHub ends the paragraph there, mkdocs does not."""


def pages() -> Iterator[Path]:
    """Every page of the repository, relative to it."""
    yield from sorted(path.relative_to(ROOT) for path in ROOT.glob("*.md"))
    for folder in _FOLDERS:
        yield from sorted(path.relative_to(ROOT) for path in (ROOT / folder).rglob("*.md"))


def stage(folder: Path) -> None:
    """Puts the pages, the notebook, and the files that they link to, into a new folder."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for page in pages():
        target = folder / page
        target.parent.mkdir(parents=True, exist_ok=True)
        text, linked = linking(page)
        target.write_text(text, encoding="utf-8")
        for file in linked:
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / file, folder / file)
    shutil.copyfile(ROOT / "docs/tutorial.ipynb", folder / "docs/tutorial.ipynb")


def linking(page: Path) -> tuple[str, tuple[Path, ...]]:
    """A page's text, with links to folders turned to their pages, and the other files that it links to.

    A blank line is put between a paragraph and its list.
    """
    linked = list[Path]()

    def turned(match: re.Match[str]) -> str:
        mark, words, target, anchor = match[1], match[2], match[3], match[4] or ""
        if ":" in target:
            return match[0]
        file = (ROOT / page.parent / target).resolve()
        if (file / "README.md").is_file():
            return f"{mark}[{words}]({target.rstrip('/')}/README.md{anchor})"
        if not file.is_file() or not file.is_relative_to(ROOT):
            return words  # a folder without a page of its own: its name says where it is
        if file.suffix not in (".md", ".ipynb"):
            linked.append(file.relative_to(ROOT))
        return match[0]

    parts = _CODE.split((ROOT / page).read_text("utf-8"))  # every second part is code
    text = _LINK.sub(turned, "".join(_hidden(parts)))  # with code hidden, as a link's words may hold some
    return _shown(_LIST_BELOW.sub(r"\1\n\n", text), parts), tuple(dict.fromkeys(linked))


def _hidden(parts: list[str]) -> Iterator[str]:
    """The text with a sign in the place of each piece of code."""
    for number, part in enumerate(parts):
        yield f"\x00{number}\x00" if number % 2 else part


def _shown(text: str, parts: list[str]) -> str:
    return re.sub(r"\x00(\d+)\x00", lambda match: parts[int(match[1])], text)
