"""Gives profiles their weights by how surely they show the mark's edge, and reads those under a highlight."""

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking import edges, lines, steps

Floats = NDArray[np.float64]

LIMIT_MISFIT = 0.16  # a profile that departs from a step by more than this share of the contrast is no edge
LIT = 0.2, 5.0  # contrasts, in shares of the typical one, that light and shadow make of an edge
SHADED = 0.08  # change of the contrast from one profile to the next but one that is no shadow's edge
CROSSED, CROSSING = 4, 0.05  # a shadow's edge lies where so many profiles and the next differ by this share of contrast
SLOPE_PULL = 0.1  # share of an edge's shift by a highlight's slope that is left when a straight slope is allowed for
SLOPE_PULL_ON_TEXTURE = 1.0  # the same beside texture
BENT_GLOW, BENT_GLOW_ON_TEXTURE = 0.02, 0.08  # misfit, in contrasts, of an edge in a straight slope under a highlight
GLOW = 0.05  # light on the dark side beside texture, in contrasts, that is no highlight yet
GLOW_BESIDE_MARGIN = 0.15  # the same beside an even margin, where the scatter tells of a slope in the light
LEAST_GLOW = 2.0  # the same in levels of 255, beside either
MOSTLY_LIT = 1.4  # usual share of the dark over that of the least lit places: texture makes no more of it
LEAST_LIT = 2  # number of groups of profiles that chance, or what covers them, makes seem less lit than any is
GLOW_LIT = 0.65, 1.5  # contrasts, in shares of the typical one, of an edge that light was added to
GROUP = 8  # neighbouring profiles whose light is compared
EVEN, UNEVEN = 0.025, 0.1  # relative difference of the light along the outline: it is even below, uneven above
OTHER_LIGHT = 0.1  # relative difference of the light on both sides of an edge that neither light nor shadow makes
OTHER_NOISE = 2.0  # the same in median deviations of single profiles


def weights_of(found: edges.Profiles, typical: float, blur: Floats) -> Floats:
    """Gives weight 1 to profiles that look like the mark's edge, else 0 (4, n).

    Args:
        found: the profiles as read.
        typical: the median contrast, of 255.
        blur: (4,) the deviation of all blur of each edge, px.
    """
    good = (found.contrast > LIT[0] * typical) & (found.contrast < LIT[1] * typical)
    good &= found.misfit < LIMIT_MISFIT * np.minimum(found.contrast, typical) + 2.0
    good &= np.abs(found.offset) < 2.5 * blur[:, None]
    if found.saturated is not None:
        good &= ~found.saturated
    return good.astype(np.float64)


def level(
    found: edges.Profiles, weight: Floats, model: steps.StepModel, *, blur: Floats, typical: float, even: bool
) -> edges.Profiles:
    """Returns the profiles as read with a slope in the light allowed for where a highlight lies on them.

    Where that is no highlight, since it is not straight, and where no whole edge is left beside the slope, the weight
    is set to 0.

    Args:
        found: the profiles as read.
        weight: (4, n) the profiles' weights, which are changed in place.
        model: the estimators in use.
        blur: (4,) the lens's blur for each edge, px.
        typical: the median contrast, of 255.
        even: True beside an even margin.
    """
    glowing = _glowing(found, weight, max((GLOW_BESIDE_MARGIN if even else GLOW) * typical, LEAST_GLOW))
    if glowing is None:
        return found
    sloped = model.sloped()
    bent = edges.misfits(found.light, sloped.misfit) > (BENT_GLOW if even else BENT_GLOW_ON_TEXTURE) * typical + 2.0
    contrast = found.sloped[:, :, 0]
    astray = (contrast < GLOW_LIT[0] * typical) | (contrast > GLOW_LIT[1] * typical)
    weight[glowing & (bent | astray)] = 0.0
    answer = found.sloped[:, :, 1] / np.maximum(contrast, 0.5)
    offset = sloped.table.place(answer) * blur[:, None]
    pull = (SLOPE_PULL if even else SLOPE_PULL_ON_TEXTURE) * (offset - found.offset)
    return found._replace(
        offset=np.where(glowing, offset, found.offset),
        pull=np.where(glowing, pull, found.pull),
        glowing=glowing,
    )


def _glowing(found: edges.Profiles, weight: Floats, allowed: float) -> NDArray[np.bool_] | None:
    """Returns profiles (4, n) whose dark side is brighter than elsewhere, though the light is not.

    A highlight lies on them.

    More light brightens the dark in proportion to the contrast; a highlight is added to it, and slopes. None when it
    lies on no profile.
    """
    if float(found.dark.max()) - float(found.dark.min()) < allowed:
        return None
    level, share = _unlit(found, weight)
    glowing = (found.dark > level + allowed) & (found.dark - share * found.contrast > allowed)
    return glowing if glowing.any() else None


def _unlit(found: edges.Profiles, weight: Floats) -> tuple[float, float]:
    """Returns the dark where no highlight lies, and its share of the contrast: what is usual along the outline.

    Where the usual share is larger than in some places by more than the plate's texture makes of it, most of the
    outline lies in a highlight: then it is that of the least lit places, told by the means of neighbours.
    """
    usual = float(np.median(found.dark / found.contrast))
    seen = np.add.reduce(weight.reshape(-1, GROUP), axis=1)
    enough = seen > 0.5 * GROUP
    if np.count_nonzero(enough) > LEAST_LIT:
        dark = np.add.reduce((found.dark * weight).reshape(-1, GROUP), axis=1)[enough]
        contrast = np.add.reduce((found.contrast * weight).reshape(-1, GROUP), axis=1)[enough]
        share = float(np.sort(dark / contrast)[LEAST_LIT])
        if usual > MOSTLY_LIT * share:
            return float(np.sort(dark / seen[enough])[LEAST_LIT]), share
    return float(np.sort(found.dark.ravel())[found.dark.size // 4]), usual


def through_shadow(found: edges.Profiles, weight: Floats, typical: float) -> edges.Profiles:
    """Returns the profiles; those that a shadow's soft edge crosses are read by the estimator that does not mind it.

    Where it crosses sharply, the weight is set to 0; beside what covers the edge the contrast changes as well.

    Args:
        found: the profiles as read.
        weight: (4, n) the profiles' weights, which are changed in place.
        typical: the median contrast, of 255.
    """
    total, good = np.add.accumulate(found.contrast, axis=1), np.add.accumulate(weight, axis=1)
    change = np.abs(total[:, 2 * CROSSED :] - 2.0 * total[:, CROSSED:-CROSSED] + total[:, : -2 * CROSSED])
    crossed = change > CROSSED * (CROSSING * typical + 1.0)
    at_edge = np.abs(found.contrast[:, 2:] - found.contrast[:, :-2]) > SHADED * typical + 1.0
    weight[:, 1:-1][at_edge] = 0.0
    if not crossed.any():
        return found
    crossed &= good[:, 2 * CROSSED :] - good[:, : -2 * CROSSED] > 2 * CROSSED - 1
    there = np.pad(crossed, ((0, 0), (CROSSED + 1, CROSSED - 1)), mode="edge")
    return found._replace(offset=found.offset + there * found.pull, pull=np.where(there, 0.0, found.pull))


def beside_another(found: edges.Profiles, weight: Floats) -> float:
    """Sets `weight` (4, n) to 0 beside an even margin where what lies beside the dark is not the margin.

    Light and shadow scale the dark and the margin alike, and a highlight is added to both. Where the contrast is
    another one and the dark is not, another thing's edge lies there, or the edge of a shadow along this one. Returns
    by how much the light differs along the outline, in shares.
    """
    seen = np.add.reduce(weight.reshape(-1, GROUP), axis=1)
    contrast = np.add.reduce((found.contrast * weight).reshape(-1, GROUP), axis=1)
    typical = max(_middle(contrast / np.maximum(seen, 1.0)), 0.5)
    departure = np.abs(contrast - typical * seen) / (typical * np.maximum(seen, 1.0))
    largest = float(departure.max())
    if largest <= UNEVEN:
        return largest
    dark = np.add.reduce((found.dark * weight).reshape(-1, GROUP), axis=1)
    in_proportion = _middle(dark / np.maximum(contrast, 1.0))
    excess = np.abs(dark - in_proportion * contrast)
    noise = _middle(np.abs(found.dark - in_proportion * found.contrast).ravel())
    other = departure > UNEVEN
    other &= excess > OTHER_LIGHT * in_proportion * contrast + OTHER_NOISE * noise * seen
    weight.reshape(-1, GROUP)[other] = 0.0
    return largest


def _middle(values: Floats) -> float:
    """Returns the upper median: several times faster than np.median."""
    return float(np.sort(values)[len(values) // 2])


def leave_out(weight: Floats, expected: lines.Edges, gap: Floats) -> Floats:
    """Sets `weight` (4, n) to 0 where a part of each edge is missing (a notch): `gap` (4, 2), in sides.

    Returns how many profiles of each edge are left (4,).
    """
    place = 0.5 + np.multiply.outer(expected.free / expected.length, lines.places(weight.shape[1]))
    none = (place > gap[:, :1]) & (place < gap[:, 1:])
    weight[none] = 0.0
    return weight.shape[1] - np.add.reduce(none, axis=1)


def readable(found: edges.Profiles) -> Floats | float:
    """Returns the numbers of profiles (4,), or one for all edges, that could have agreed.

    Saturated ones say nothing, up to half of an edge.
    """
    count = found.offset.shape[1]
    if found.saturated is None:
        return float(count)
    return np.maximum(count - np.add.reduce(found.saturated, axis=1), 0.5 * count)
