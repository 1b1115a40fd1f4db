"""The pictures of a family: confusion, reliability of the probabilities, detection against strength, ranks."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import binom, norm

from station.pages.caption import Caption
from station.pages.drawing import COLOURS, style
from station.pages.figure import drawn, kept_in
from station.physics.contact import Array
from tests.proof.gates import reliability
from tests.proof.intervals import wilson
from tests.proof.scoring import Scored, of_kind

STRENGTHS = (0.5, 1.0, 2.0, 4.0)
RANKS = 8
_BLUE, _ORANGE = COLOURS[0], COLOURS[4]
_WILSON = "bars: 95 % intervals (Wilson)"


Drawing = tuple[Figure, Caption]


@dataclass(frozen=True, kw_only=True)
class Shown:
    """A picture that was drawn: the stem of its files, its caption as plain text, and both as a part of a page."""

    name: str
    told: str
    html: str


def draw_all(cases: Sequence[Scored], folder: Path, name: str) -> list[Shown]:
    """Draws the pictures that a family's cases have something for, and writes each as NAME-….svg and .pdf.

    Their captions name the command of `made_by`.
    """
    kinds = {"confusion": confusion, "reliability": reliability_curve, "detection": detection, "ranks": ranks}
    with style(), kept_in(folder):
        made = {f"{name}-{kind}": draw(cases) for kind, draw in kinds.items()}
        return [_shown(stem, *drawing) for stem, drawing in made.items() if drawing is not None]


def _shown(name: str, figure: Figure, caption: Caption) -> Shown:
    return Shown(name=name, told=caption.text, html=drawn(figure, caption, name=name, alt=caption.shows))


def confusion_counts(cases: Sequence[Scored]) -> Counter[tuple[str, str]]:
    """Counts how often a truth (an effect, `none`, `other`) got a first name; strong singles, nulls, outside."""
    counts = Counter[tuple[str, str]]()
    for case in of_kind(cases, "null"):
        counts["none", case.said.first] += 1
    for case in of_kind(cases, "outside"):
        counts["other", case.said.first] += 1
    for case in of_kind(cases, "single"):
        if case.strong:
            counts[case.truth.effects[0].id, case.said.first] += 1
    return counts


def confusion(cases: Sequence[Scored]) -> Drawing | None:
    """Truth down, first name across, each row as shares of its cases."""
    counts = confusion_counts(cases)
    if not counts:
        return None
    rows = sorted({truth for truth, _ in counts}, key=_last)
    columns = sorted({first for _, first in counts} | set(rows), key=_last)
    table = np.array([[counts[truth, first] for first in columns] for truth in rows], dtype=np.float64)
    shares = table / table.sum(axis=1, keepdims=True)
    figure = Figure(figsize=(max(4.0, 2.2 + 0.3 * len(columns)), 1.8 + 0.24 * len(rows)), layout="constrained")
    axes = figure.subplots()
    axes.imshow(shares, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    axes.set_xticks(range(len(columns)), columns, rotation=90)
    axes.set_yticks(range(len(rows)), [f"{name} ({int(n)})" for name, n in zip(rows, table.sum(axis=1), strict=True)])
    for i, j in zip(*np.nonzero(table), strict=True):
        axes.text(j, i, str(int(table[i, j])), ha="center", va="center", color="w" if shares[i, j] > 0.6 else "k")
    axes.set(xlabel="named first", ylabel="concealed (cases)")
    shows = (
        "What was concealed and what was named first: nulls, strong singles, and what is outside the catalogue. The "
        "shade is the share of a row's cases, the number how many they are."
    )
    return figure, Caption(shows=shows, count=f"{counts.total()} cases")


def _last(name: str) -> tuple[bool, str]:
    return name in ("none", "other", "fault"), name


def reliability_curve(cases: Sequence[Scored]) -> Drawing | None:
    """The share that was right of what was said with a probability, with Wilson intervals."""
    rows = np.array([(said, right) for one in cases for said, right in one.statements()], dtype=np.float64)
    if not len(rows):
        return None
    figure = Figure(figsize=(3.4, 3.2), layout="constrained")
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], color="0.7", lw=0.8)
    for said, right, weight in reliability(rows):
        count = round(weight * len(rows))
        _point(axes, said, right, count, _BLUE)
        axes.annotate(str(count), (said, right), xytext=(4, -8), textcoords="offset points", color="0.4")
    axes.set(xlim=(0, 1.02), ylim=(-0.02, 1.02), xlabel="probability that was said", ylabel="share that was right")
    shows = (
        "How much the probabilities are worth: of the claims that were made with a probability, the share that was "
        "right. On the line they mean what they say; beside each point, the number of its claims."
    )
    return figure, Caption(shows=shows, count=f"{len(rows)} claims", interval=_WILSON)


def _point(axes, x: float, share: float, count: int, colour: str) -> None:  # pyright: ignore[reportMissingParameterType, reportUnknownParameterType]  # matplotlib's own
    low, high = wilson(round(share * count), count)
    reach = np.array([[max(share - low, 0.0)], [max(high - share, 0.0)]])
    axes.errorbar([x], [share], yerr=reach, fmt="o", ms=4, lw=0.8, color=colour)


def detected(cases: Sequence[Scored]) -> dict[str, dict[float, list[tuple[bool, bool]]]]:
    """Returns, by effect and strength of the single cases, if anything was claimed, and if the name was right."""
    found: dict[str, dict[float, list[tuple[bool, bool]]]] = {}
    for case in of_kind(cases, "single"):
        effect = case.truth.effects[0]
        if not math.isfinite(effect.strength):
            continue
        near = min(STRENGTHS, key=lambda strength: abs(np.log(max(effect.strength, 1e-6) / strength)))
        found.setdefault(effect.id, {}).setdefault(near, []).append((bool(case.said.claimed), case.right_first))
    return found


def detection(cases: Sequence[Scored]) -> Drawing | None:
    """One small plot for each effect: share detected and share rightly named against strength."""
    found = detected(cases)
    if not found:
        return None
    across = 5
    down = -(-(len(found) + 1) // across)
    figure = Figure(figsize=(2.0 * across, 1.6 * down + 0.3), layout="constrained")
    grid = figure.subplots(down, across, sharex=True, sharey=True, squeeze=False).ravel()
    everything: dict[float, list[tuple[bool, bool]]] = {}
    for strengths in found.values():
        for strength, hits in strengths.items():
            everything.setdefault(strength, []).extend(hits)
    for axes, (name, strengths) in zip(grid, [("all effects", everything), *sorted(found.items())], strict=False):
        _curve(axes, name, strengths)
    for axes in grid[len(found) + 1 :]:
        axes.set_visible(False)
    figure.supxlabel("strength in the generator's unit")
    figure.supylabel("share of cases")
    shows = (
        "Single effects against their strength: the share that was detected (blue), and rightly named (orange). At the "
        "bottom of each panel, the numbers of cases."
    )
    number = sum(len(hits) for hits in everything.values())
    return figure, Caption(shows=shows, count=f"{number} single effects", interval=_WILSON)


def ranks(cases: Sequence[Scored]) -> Drawing | None:
    """Draws the ranks of the truths in what was said of their numbers; flat where the errors are right."""
    pulls = [pull.z for one in of_kind(cases, "single", "pair") for pull in one.pulls()[0]]
    if not pulls:
        return None
    count, even = len(pulls), 1.0 / RANKS
    low, high = (float(binom.ppf(level, count, even)) for level in (0.025, 0.975))
    figure = Figure(figsize=(3.4, 2.4), layout="constrained")
    axes = figure.subplots()
    axes.hist(norm.cdf(-np.array(pulls)), bins=RANKS, range=(0, 1), color=_BLUE)
    axes.axhspan(low, high, color="0.85", zorder=0)
    axes.set(xlim=(0, 1), xlabel="share of the stated distribution below the truth", ylabel="numbers")
    shows = (
        "Where the true numbers lie in the distributions that were stated of them: even where the stated errors are "
        "right."
    )
    return figure, Caption(shows=shows, count=f"{count} numbers", interval="band: holds 95 % of even counts")


def _curve(axes, name: str, strengths: dict[float, list[tuple[bool, bool]]]) -> None:  # pyright: ignore[reportMissingParameterType, reportUnknownParameterType]  # matplotlib's own
    for column, colour, shift in ((0, _BLUE, 0.97), (1, _ORANGE, 1.03)):
        points: list[tuple[float, float]] = []
        for strength, hits in sorted(strengths.items()):
            got: Array = np.array([hit[column] for hit in hits], dtype=np.float64)
            points.append((strength * shift, float(got.mean())))
            _point(axes, *points[-1], len(hits), colour)
        axes.plot(*np.array(points).T, color=colour, lw=0.8)
    for strength, hits in strengths.items():
        axes.text(strength, 0.0, str(len(hits)), ha="center", va="top", fontsize=6, color="0.4")
    axes.set_xscale("log")
    axes.set_xticks(STRENGTHS, [f"{strength:g}" for strength in STRENGTHS])
    axes.minorticks_off()
    axes.set(ylim=(-0.12, 1.05), title=name)
