"""The analysis of recordings: the friction of each surface pair, by direction, with what can be concluded from it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rich.console import RenderableType

from shared.errors import UserError
from shared.installed import missing_as_user_error
from shared.messages import CameraGeometry
from station.app import analysing
from station.app.analysing import notes_of
from station.app.analysis_files import flagged, write_results
from station.app.attached import planted_in_recording
from station.app.front import columns
from station.app.front.page import fragment
from station.app.front.recording import FilePath, Recording, path_of
from station.app.front.seeds import seed_of
from station.app.front.table import Table
from station.app.front.text import as_text
from station.app.sessions import geometry_of, read_sessions, session_of
from station.friction.conclusions import conclusions
from station.friction.drawing import picture
from station.friction.figures import figure_kinds
from station.friction.filters import CUTOUT_M
from station.friction.pairs import Session
from station.friction.report import Picture, caption_of, html_conclusions, html_figure, html_report, html_table
from station.friction.report_tables import tables
from station.friction.results import PairResult, limit_curve_table
from station.pages.caption import command_line, made_by

Source = Recording | Session | FilePath

_SHOWN = ("polar", "limit_curve")
"""The figures that a notebook shows of each pair; the report has all."""


@missing_as_user_error()
def analyze(
    recordings: Source | Sequence[Source],
    *,
    calibration: FilePath | None = None,
    cutout_m: float = CUTOUT_M,
    seed: int = 1,
) -> Analysed:
    """Filters the samples, tests anisotropy and fits limit curves, as `station analyze` does.

    Args:
        recordings: recordings, or paths of recordings (.mcap) or tables of samples (.csv, .parquet), or sessions that
            were read before; one, or several, whose samples of one object on one plate are put together.
        calibration: the path of a recording whose calibration stands in for files that have none.
        cutout_m: the radius of the opening in the foam (m).
        seed: of the permutation tests.

    Raises:
        UserError: if a file is missing, damaged or of another kind, the seed is none, or there is no sample.
    """
    sessions = _sessions(_every(recordings), spare=_spare(calibration))
    return Analysed(
        results=analysing.results_of(sessions, cutout_m=cutout_m, seed=seed_of(seed)),
        sessions=tuple(sessions),
        command=command_line(
            *("station", "analyze", *(session.source for session in sessions)),
            calibration=calibration,
            cutout_mm=None if cutout_m == CUTOUT_M else f"{1e3 * cutout_m:g}",
            seed=None if seed == 1 else seed,
        ),
    )


def _every(recordings: Any) -> list[Source]:
    """Returns one or several sources as a list; what is none is refused where it is read."""
    if isinstance(recordings, Recording | Session | str | Path):
        return [recordings]
    several: Any = recordings if isinstance(recordings, Iterable) else [recordings]
    return list(several)


def _spare(calibration: FilePath | None) -> CameraGeometry | None:
    spare = geometry_of(path_of(calibration)) if calibration is not None else None
    if calibration is not None and spare is None:
        raise UserError(f"Expected a recording with a calibration, but {calibration} has none")
    return spare


def _sessions(every: Sequence[Source], *, spare: CameraGeometry | None) -> list[Session]:
    """Returns the sessions in their order; files are read together, as large ones take several processes."""
    files = [path_of(one) for one in every if not isinstance(one, Recording | Session)]
    read = iter(read_sessions(files, spare=spare))
    return [_given_session(one, spare) if isinstance(one, Recording | Session) else next(read) for one in every]


def _given_session(one: Recording | Session, spare: CameraGeometry | None) -> Session:
    if isinstance(one, Recording):
        return _open_session(one, spare)
    return replace(one, geometry=one.geometry or spare)


def _open_session(recording: Recording, spare: CameraGeometry | None) -> Session:
    geometry = geometry_of(recording.reader.path) or spare
    notes = planted_in_recording(recording.reader)
    return session_of(recording.every_sample, geometry=geometry, source=recording.name, notes=notes)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Analysed:
    """An analysis that shows itself; `results` has the numbers of each surface pair, `sessions` what was read.

    `command` is the one in the terminal that makes the same.
    """

    results: tuple[PairResult, ...]
    sessions: tuple[Session, ...]
    command: str

    @property
    def samples(self) -> Table:
        """The samples of all pairs; `flags` names the filters that flagged each. Columns are those of a recording."""
        return Table("analysed samples", columns.samples(flagged(self.results)))

    @property
    def sentences(self) -> dict[str, tuple[str, ...]]:
        """The conclusions that can and cannot be drawn, by the pair's name ("steel on wood")."""
        return {result.pair.name: tuple(note.text for note in conclusions(result)) for result in self.results}

    @property
    def has_findings(self) -> bool:
        """True if something that was asked of the data cannot be concluded."""
        return analysing.has_findings(self.results)

    @property
    def limit_curves(self) -> dict[str, Any]:
        """The fitted limit curves and distributions of friction: what limit_curves.json holds."""
        return limit_curve_table(self.results)

    def to_html(self) -> str:
        """Returns the whole report as one page that fetches nothing; its figures take seconds to draw."""
        with made_by(self.command):
            pictures = {result.pair.name: _pictures(result) for result in self.results}
            return html_report(self.results, sources=self._sources, pictures=pictures, notes=notes_of(self.sessions))

    def write(self, folder: FilePath) -> list[str]:
        """Writes report, figures, samples and limit curves into a folder; gives lines that say where they are.

        Raises:
            UserError: if the folder cannot be written to.
        """
        with made_by(f"{self.command} {command_line(out=folder)}"):
            return write_results(self.results, Path(folder), sources=self._sources, notes=notes_of(self.sessions))

    @property
    def _sources(self) -> list[str]:
        return [session.source for session in self.sessions]

    def in_words(self) -> Iterator[RenderableType]:
        """Returns tables and conclusions for a rich.Console."""
        return analysing.in_words(self.results, self.sessions)

    def __repr__(self) -> str:
        """Returns the words that `station analyze` prints."""
        return as_text(self.in_words())

    def _repr_html_(self) -> str:
        """Returns conclusions, tables and two figures of each pair, for a notebook."""
        parts: list[str] = []
        with made_by(self.command):
            for result in self.results:
                parts.append(html_conclusions(result.pair.name, conclusions(result)))
                parts += [html_figure(result.pair, one) for one in _pictures(result, _SHOWN)]
        return fragment(*parts, *map(html_table, tables(self.results)))


def _pictures(result: PairResult, names: Sequence[str] = ()) -> list[Picture]:
    kinds = [kind for kind in figure_kinds() if not names or kind.name in names]
    pair = result.pair
    return [Picture(kind, picture(kind.draw, pair, caption=caption_of(kind, pair))) for kind in kinds]
