"""A page in one file, which fetches nothing and runs nothing: the style that all of them share, and its frame."""

from __future__ import annotations

from html import escape
from string import Template

_PAGE = Template("""\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>$title</title>
<style>
:root { --ink: #1a1a1a; --faint: #555; --paper: #fff;
--card: #f4f4f4; --line: #e4e4e4; --rule: #888; --bad: #a3161a; }
@media (prefers-color-scheme: dark) {
:root { --ink: #e8e8e8; --faint: #a8a8a8; --paper: #16181a;
--card: #24272a; --line: #33373b; --rule: #777; --bad: #ff8a80; }
a { color: #6cb8e6; }
}
body { font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper); max-width: 64rem;
margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.25rem; margin-top: 2.5rem; } h3 { font-size: 1rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .85rem; margin: 1rem 0; }
caption { text-align: left; font-weight: 600; padding: .3rem 0; }
th, td { padding: .2rem .7rem; vertical-align: top; }
th { border-bottom: 1px solid var(--rule); white-space: nowrap; } td { border-bottom: 1px solid var(--line); }
.note, figcaption, footer { color: var(--faint); font-size: .85rem; max-width: 50rem; }
li.finding { color: var(--bad); }
figure { margin: 1.5rem 0; }
/* On a phone a drawing scrolls within a box (.wide): at the page's width its letters would have three pixels. */
figure img, figure svg { max-width: max(100%, 48rem); height: auto; background: #fff; color: #000; border-radius: 4px; }
@media screen and (prefers-color-scheme: dark) {
/* White becomes the paper (1 - .91) and black the ink, while colours keep their hues. */
figure img, figure svg { filter: invert(.91) hue-rotate(180deg); }
}
/* The same holds for a table of many columns, whose sentences would have a word a line. */
@media screen and (max-width: 48rem) { .wide table:has(th:nth-child(6)) { min-width: 48rem; } }
pre, code { background: var(--card); } code { overflow-wrap: anywhere; } pre { padding: .8rem; overflow-x: auto; }
$style
@media print {
:root { --ink: #000; --faint: #333; --paper: #fff; --card: #fff; --line: #ccc; --rule: #000; --bad: #000; }
html { font-size: 11px; } body { margin: 0; max-width: none; font-size: 11px; } nav { display: none; }
th, td { white-space: normal !important; padding: .15rem .4rem; }
section { break-inside: auto; } h2 { break-after: avoid; } figure, table, tr { break-inside: avoid; }
.wide { overflow: visible; } figure img, figure svg { max-width: 100%; }
}
</style>
</head>
<body>
$body
</body>
</html>
""")


def whole_page(*, title: str, body: str, style: str = "") -> str:
    """Returns the page; `body` is HTML, and `style` are rules of its own that come after the common ones."""
    return _PAGE.substitute(title=escape(title), body=body, style=style)
