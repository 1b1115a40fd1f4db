"""Surface pairs: which samples belong together, and what the filters say of them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from shared.messages import CameraGeometry, Sample
from station.friction.filters import Flags, Opening, filter_slides
from station.friction.robust import robust_flags
from station.friction.slides import Slides, joined, slides_of

UNNAMED = "unnamed"


@dataclass(frozen=True, eq=False)
class Session:
    """One file's samples and calibration (None: it has none); `notes` are what its reader has to know of its rig."""

    samples: Sequence[Sample]
    geometry: CameraGeometry | None = None
    source: str = ""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False, kw_only=True)
class Pair:
    """All samples of an object on a plate, with their columns and flags, row for row.

    `uncalibrated` are the sources of the sessions without a calibration, of all `sources`; `kept` are the slides that
    the paper's filters left.
    """

    object: str
    plate: str
    samples: tuple[Sample, ...]
    slides: Slides
    flags: Flags
    robust: Flags
    opening: Opening
    sources: tuple[str, ...]
    uncalibrated: tuple[str, ...]

    @property
    def name(self) -> str:
        """The name as the paper writes it: 'steel on wood'."""
        return f"{self.object} on {self.plate}"

    @property
    def kept(self) -> Slides:
        """The slides that no filter flagged."""
        return self.slides.where(self.flags.kept)


def pairs_of(sessions: Iterable[Session], *, opening: Opening | None = None) -> tuple[Pair, ...]:
    """Gives the surface pairs of all sessions by name; one object on one plate is one pair, from however many files."""
    found: defaultdict[tuple[str, str], list[Session]] = defaultdict(list)
    for session in sessions:
        groups: defaultdict[tuple[str, str], list[Sample]] = defaultdict(list)
        for sample in session.samples:
            if sample.disturbed:
                continue  # something else than friction had a hand in it: no filter judges it, no mean counts it
            groups[sample.object or UNNAMED, sample.plate or UNNAMED].append(sample)
        for key, samples in groups.items():
            found[key].append(Session(samples, session.geometry, session.source))
    return tuple(_pair(key, parts, opening or Opening()) for key, parts in sorted(found.items()))


def _pair(key: tuple[str, str], parts: Sequence[Session], opening: Opening) -> Pair:
    slides = joined([slides_of(part.samples, part.geometry) for part in parts])
    return Pair(
        object=key[0],
        plate=key[1],
        samples=tuple(sample for part in parts for sample in part.samples),
        slides=slides,
        flags=filter_slides(slides, opening=opening),
        robust=robust_flags(slides, opening=opening),
        opening=opening,
        sources=tuple(part.source for part in parts),
        uncalibrated=tuple(part.source for part in parts if part.geometry is None),
    )
