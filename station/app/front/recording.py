"""A recorded session with its samples and signals as tables."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path

import numpy as np
from rich.console import RenderableType
from rich.text import Text

from shared.errors import UserError
from shared.messages import Sample
from shared.notes import note_line
from shared.rig import RigConfig
from station.app.attached import planted_in_recording
from station.app.foam import free_of_foam_m
from station.app.front import columns
from station.app.front.page import fragment, html_table
from station.app.front.table import Table
from station.app.front.text import as_text
from station.app.sample_tables import directions_table
from station.app.simulating import rig_of
from station.pages import pieces
from station.pages.caption import made_by
from station.recording.arrays import load_signals
from station.recording.reader import RecordingReader, open_recording
from station.signals.session import Signals

FilePath = str | Path
"""The path of a file, as a text or a `Path`."""


def open(path: FilePath) -> Recording:
    """Opens a finished recording (.mcap); its tables are read when they are first asked for.

    Raises:
        UserError: in one sentence, if there is no such file, or it is empty, broken off, damaged or something else.
    """
    return Recording(open_recording(path_of(path)))


class Recording:
    """A session: what was measured in its runs, as tables. Nothing in it changes the file.

    Times (`time_ns`, `…_ns`) are whole nanoseconds since 1970 on the station's clock, and those of a row the moment of
    its capture. Lengths are in metres, angles in radians. The plate frame has its origin on the plate's surface, at its
    centre, x along the image's x and z along the plate's normal; the world has z up and its origin at the arm's base.
    Pixels are OpenCV's: the centre of the top-left one is (0, 0), x is right and y is down. `run` is the number of the
    run that went on at that time; 0 is the small motion before the first run, and -1 means none. A quantity that is
    unknown is nan.
    """

    def __init__(self, reader: RecordingReader) -> None:
        """Takes an opened recording; `station.open` opens one."""
        self.reader = reader

    @property
    def name(self) -> str:
        """The path of the file."""
        return str(self.reader.path)

    @cached_property
    def signals(self) -> Signals:
        """All signals as arrays (`station.signals`), without the samples of disturbed runs.

        Raises:
            UserError: if the file is damaged.
        """
        return load_signals(self.reader)

    @cached_property
    def every_sample(self) -> tuple[Sample, ...]:
        """The samples as messages, in the order in which they were taken.

        Raises:
            UserError: if the file is damaged.
        """
        return self.reader.samples()

    def rig(self, path: FilePath | None = None) -> RigConfig:
        """Returns the rig of the file at `path`, or else the one that the recording carries.

        Raises:
            UserError: if there is none, or it cannot be read.
        """
        return rig_of(self.reader, path=None if path is None else path_of(path))

    # --- tables -------------------------------------------------------------------------------------------------------

    @cached_property
    def samples(self) -> Table:
        """A row for each run that came to its end, with the columns of `station samples --csv`.

        `onset_angle_rad` is the tilt at which the block begins to slide on a plate at rest, with its standard deviation
        `onset_sigma_rad`; of a `censored` run, which did not slide, the steepest tilt. `flags` are separated by "|".
        Vectors are numbered: `euler_rad_0` to `_2`; corners as x0, y0, x1, y1, x2, y2, x3, y3 in pixels. `start_…` is
        the block's pose in the plate frame before the tilt.
        """
        free_m = free_of_foam_m(self.every_sample, self.reader.path)
        more = {name: np.array(values) for name, values in free_m.items()}
        return self._table("samples", columns.samples(self.every_sample) | more)

    @cached_property
    def corners(self) -> Table:
        """A row for each frame: the corners of the block's mark in the image (px), nan where it was not found.

        `dt0_ns` to `dt3_ns` are each corner's own mid-exposure after `time_ns`; `sigma_px` is the standard deviation of
        one corner in x and in y.
        """
        return self._table("corners", columns.corners(self.signals))

    @cached_property
    def poses(self) -> Table:
        """A row for each frame in which the block was found: its place (m) and yaw (rad) in the plate frame.

        `flat` is False while the block tips. Without a calibration of the camera there is no row.
        """
        return self._table("poses", columns.poses(self.signals))

    @cached_property
    def attitude(self) -> Table:
        """A row for each attitude of the plate: quaternion world_from_plate, rate in the plate, pivot in the world.

        `tilt_rad` is the angle between the plate's normal and up.
        """
        return self._table("attitude", columns.attitude(self.signals))

    @cached_property
    def events(self) -> Table:
        """A row for each phase of a run that began; `step` is the tilt step that STEP_BEGIN and STEP_END speak of."""
        return self._table("events", columns.of_track(self.signals.events))

    @cached_property
    def commands(self) -> Table:
        """A row for each command to the arm: tilt to `angle_rad` about the axis at `azimuth_rad` in the plate."""
        return self._table("commands", columns.of_track(self.signals.commands))

    @cached_property
    def motions(self) -> Table:
        """A row for each motion of the arm that ended, from `time_ns` to `end_ns`."""
        return self._table("motions", columns.of_track(self.signals.motions))

    @cached_property
    def environment(self) -> Table:
        """A row for each reading of the air: temperature (°C) and relative humidity (%)."""
        return self._table("environment", columns.of_track(self.signals.environment))

    def _table(self, name: str, values: columns.Columns) -> Table:
        return Table(f"{name} of {self.name}", values)

    # --- what it shows ------------------------------------------------------------------------------------------------

    def __repr__(self) -> str:
        """Returns the recording in words, and the onsets by direction."""
        return as_text(self._shown())

    def _shown(self) -> Sequence[RenderableType]:
        table = [directions_table(self.every_sample)] if self.every_sample else []
        return [self._about(), *table, *map(Text, self._notes())]

    def _notes(self) -> list[str]:
        """Notes on what a simulated rig conceals on purpose."""
        return [note_line(note) for note in planted_in_recording(self.reader)]

    def _about(self) -> str:
        runs = len(self.every_sample)
        counted = f"{runs} sample{'s' * (runs != 1)}" if runs else "no samples: no run of the session came to its end"
        return f"{self.name}: {counted}{self._when()}"

    def _when(self) -> str:
        if not self.reader.start_ns:
            return "; it is empty"
        begin = datetime.fromtimestamp(self.reader.start_ns * 1e-9, UTC)
        return f"; {self.reader.duration_s:.1f} s from {begin:%Y-%m-%d %H:%M:%S} UTC"

    def _repr_html_(self) -> str:
        """Returns the same with a figure, for a notebook."""
        parts = [pieces.paragraph(line) for line in (self._about(), *self._notes())]
        if self.every_sample:
            from station.app.front.figures import onsets_by_run  # noqa: PLC0415  # matplotlib is slow to load

            with made_by(f"station.open({self.name!r})"):
                parts += [html_table(directions_table(self.every_sample)), onsets_by_run(self.every_sample)]
        return fragment(*parts)


def opened(recording: Recording | FilePath) -> Recording:
    """Returns the recording itself, or the one at that path.

    Raises:
        UserError: as `open`.
    """
    return recording if isinstance(recording, Recording) else open(recording)


def path_of(path: FilePath, *, expected: str = "a recording or the path of a file") -> Path:
    """Returns the path of a file that was named.

    Raises:
        UserError: for what is no path.
    """
    try:
        return Path(path)
    except TypeError:
        raise UserError(f"Expected {expected}, got {type(path).__name__}") from None
