"""Pieces of a page: tables, sections and paragraphs."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape


def table(head: Sequence[str], rows: Sequence[Sequence[str]], *, caption: str = "", note: str = "") -> str:
    """Returns an HTML table of cells that are HTML already; head, caption and the note below it are plain text."""
    title = f"<caption>{escape(caption)}</caption>" if caption else ""
    top = "".join(f"<th>{escape(word)}</th>" for word in head)
    body = "\n".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    below = paragraph(note, kind="note") if note else ""
    return f'<div class="wide"><table>{title}<thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>{below}'


def section(title: str, *parts: str, name: str) -> str:
    """Returns a section; `name` is its anchor."""
    return f'<section id="{name}"><h2>{escape(title)}</h2>{"".join(parts)}</section>'


def paragraph(text: str, *, kind: str = "") -> str:
    """Returns a paragraph of plain text."""
    return f'<p class="{kind}">{escape(text)}</p>' if kind else f"<p>{escape(text)}</p>"


def made_with(command: str, *, notes: str = "") -> str:
    """Returns the foot of a page: notes on what stands on it, and the command that makes it again."""
    first = paragraph(notes) if notes else ""
    return f"<footer>{first}<p>Made by <code>{escape(command)}</code></p></footer>"
