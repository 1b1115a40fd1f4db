"""Concludes what can be concluded from a pair's samples, and says what cannot, one sentence each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from station.friction.anisotropy import CONFOUNDED, LEAST_SAMPLES, AnisotropyTest, resultant
from station.friction.pairs import UNNAMED
from station.friction.report_curves import curve_sentences
from station.friction.report_table import percent
from station.friction.results import PairResult
from station.friction.slides import counted

LEVEL = 0.05
_SAME_MASS = 0.01
_NAMED = 3
"""The largest number of files that a sentence names."""


@dataclass(frozen=True, slots=True)
class Note:
    """A sentence; a `finding` says that something cannot be concluded from these data."""

    text: str
    finding: bool = False


def conclusions(result: PairResult) -> tuple[Note, ...]:
    """Returns the sentences about one pair: what it comes to first, then what limits it."""
    if not result.counts.samples:
        return (_nothing_slid(result), *_mixed(result))
    if not result.summary.samples:
        return (_all_filtered(result), *_calibration(result), *_mixed(result))
    notes = [_mean(result), _anisotropy(result)]
    for more in (_plate(result), _curve(result), _few(result), _censored(result), _calibration(result), _mark(result)):
        notes += more
    return (*notes, *_mixed(result), *_unresolved(result))


def _nothing_slid(result: PairResult) -> Note:
    steepest = math.degrees(float(result.pair.slides.tilt_rad.max()))
    return Note(
        f"All samples are censored: no block slid up to {steepest:.1f}°, so the friction angle is above that, "
        "and nothing more can be said.",
        finding=True,
    )


def _all_filtered(result: PairResult) -> Note:
    counts = result.counts
    worst = max(counts.by_filter, key=lambda name: counts.by_filter[name])
    return Note(
        f"{'The only sample' if counts.samples == 1 else f'All {counts.samples} samples'} that slid "
        f"{'was' if counts.samples == 1 else 'were'} filtered, most by the "
        f"{worst} filter ({counts.by_filter[worst]}): there is "
        "no angle of repose to report; look at Fig. 6 for what the filter saw.",
        finding=True,
    )


def _mean(result: PairResult) -> Note:
    summary = result.summary
    if summary.samples == 1:
        return Note(
            f"One sample is kept, at {math.degrees(summary.theta_rad):.2f}°: its scatter cannot be told.", finding=True
        )
    mean, error = math.degrees(summary.theta_rad), math.degrees(summary.standard_error_rad)
    return Note(
        f"Angle of repose {mean:.2f} ± {error:.2f}° (mean and its standard error "
        f"of {summary.samples} kept samples), scatter {percent(summary.scatter)} from run to run, µ = {summary.mu:.3f}."
    )


def _anisotropy(result: PairResult) -> Note:
    test, kept = result.object_test, result.pair.kept
    if test is not None:
        return Note(_verdict(test, "object"))
    known = int(np.isfinite(kept.object_rad).sum())
    if not known:
        return Note(
            "The corners of the mark are missing: θ is the plate's inclination, as if every block slid straight down, "
            "and nothing can be said about anisotropy.",
            finding=True,
        )
    if known < LEAST_SAMPLES:
        return Note(f"Anisotropy cannot be tested with {counted(known)}; {LEAST_SAMPLES} are needed.", finding=True)
    return Note(
        "The block slid along a single direction relative to itself: the angle of repose holds for that direction, and "
        "nothing can be said about anisotropy; tilt in more directions, or turn the block.",
        finding=True,
    )


def _verdict(test: AnisotropyTest, relation: str) -> str:
    """Says what the test found. The ratio that chance alone gives is told only where chance is the explanation."""
    p, ratio = f"p = {test.p_adjusted:.2g}", f"highest over lowest µ {test.ratio:.3f}"
    if test.p_adjusted < LEVEL:
        at = math.degrees(test.highest_rad) % 360
        return (
            f"Friction depends on the sliding direction against the {relation}, highest at {at:.0f}° ({p}; {ratio}; "
            f"direction explains {percent(test.omega2, 0)} of the scatter)."
        )
    return (
        f"No dependence on the sliding direction against the {relation} was found ({p}; {ratio}, and chance alone "
        f"stays below {test.ratio_by_chance:.3f} in 95 %)."
    )


def _plate(result: PairResult) -> list[Note]:
    test = result.plate_test
    if test is None:
        return []
    slides = result.pair.kept
    if resultant(slides.orientation_rad[np.isfinite(slides.orientation_rad)]) > CONFOUNDED:
        return [
            Note(
                "The block hardly turned on the plate, so that a direction of the object and one of the plate cannot "
                "be told apart; turn the block or the plate in its mount between sessions.",
                finding=True,
            )
        ]
    notes = [Note(_verdict(test, "plate"))]
    both = result.object_test
    if both is not None and test.p_adjusted < LEVEL and both.p_adjusted < LEVEL:
        given = {"object": both.p_given_other, "plate": test.p_given_other}
        notes.append(
            Note(
                "With the other's share taken out first, p = "
                + " and ".join(f"{p:.1g} against the {name}" for name, p in given.items() if not math.isnan(p))
                + "."
            )
        )
    return notes


def _curve(result: PairResult) -> list[Note]:
    return [Note(sentence) for sentence in curve_sentences(result)]


def _few(result: PairResult) -> list[Note]:
    number = result.summary.samples
    if not 1 < number < LEAST_SAMPLES:
        return []
    unsure = 1 / math.sqrt(2 * (number - 1))
    return [
        Note(
            f"Fewer than {LEAST_SAMPLES} samples are kept ({number}): the scatter is known only to ± "
            f"{percent(unsure, 0)}, and the filters of three standard deviations hardly find anything.",
            finding=True,
        )
    ]


def _censored(result: PairResult) -> list[Note]:
    counts = result.counts
    if not counts.censored:
        return []
    total = counts.samples + counts.censored
    return [
        Note(
            f"{counts.censored} of {total} samples ({percent(counts.censored / total)}) are censored: those runs ended "
            "without a slide. As each would have taken more than the tilt it reached, the mean above is too low."
        )
    ]


def _calibration(result: PairResult) -> list[Note]:
    sources, without = result.pair.sources, result.pair.uncalibrated
    if not without:
        return []
    which = "There is no calibration" if len(without) == len(sources) else _among(without, len(sources))
    return [
        Note(
            f"{which}: without one, directions hold if the camera looked straight down with its x along the plate's, "
            "and the border filter could not be applied (flags that it gave earlier stay); --calibration "
            "RECORDING supplies one.",
            finding=True,
        )
    ]


def _among(without: Sequence[str], number: int) -> str:
    """Returns the note on files that have no calibration."""
    names = ", ".join(without[:_NAMED]) + (" …" if len(without) > _NAMED else "")
    verb = "has" if len(without) == 1 else "have"
    return f"{len(without)} of {number} files {verb} no calibration ({names})"


def _mark(result: PairResult) -> list[Note]:
    if not result.pair.slides.shape.square or not np.isfinite(result.pair.kept.object_rad).any():
        return []
    return [
        Note(
            "The mark is square and has no short side: the folded directions (Figs. 7 and 9) are against its own x, "
            "which its identity gives."
        )
    ]


def _mixed(result: PairResult) -> list[Note]:
    pair, notes = result.pair, list[Note]()
    if UNNAMED in (pair.object, pair.plate):
        what = " and ".join(word for word, name in (("object", pair.object), ("plate", pair.plate)) if name == UNNAMED)
        notes.append(
            Note(
                f"The samples do not name their {what}: whatever was measured is treated as one surface pair.",
                finding=True,
            )
        )
    masses = pair.slides.mass_kg[pair.slides.mass_kg > 0]
    if len(masses) and masses.max() > masses.min() * (1 + _SAME_MASS):
        notes.append(
            Note(
                f"Blocks of different masses ({masses.min() * 1e3:.3g} to {masses.max() * 1e3:.3g} g) go by one name: "
                "mean, scatter and directions are those of the mixture; name them apart to tell them apart.",
                finding=True,
            )
        )
    return notes


def _unresolved(result: PairResult) -> list[Note]:
    number = int((result.pair.slides.unresolved & result.pair.flags.kept).sum())
    if not number:
        return []
    return [
        Note(
            f"For {number} of the kept samples no onset could be fitted; they have the threshold rule's angle, which "
            "reads late."
        )
    ]
