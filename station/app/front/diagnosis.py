"""The diagnosis of a recording: where it differs from a simulation, and which physics that is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w

from shared.installed import missing_as_user_error
from station.app.diagnosing import diagnose_file, diagnose_session
from station.app.front.page import fragment
from station.app.front.recording import FilePath, Recording, path_of
from station.app.front.seeds import seed_of
from station.app.front.text import as_text
from station.app.outputs import write_text
from station.app.planned import RecordedPlan
from station.diagnosis.diagnose import Examined
from station.diagnosis.predict import folds
from station.diagnosis.report.ending import numerics
from station.diagnosis.report.fit import fit
from station.diagnosis.report.headline import about, headline
from station.diagnosis.report.page import html_page
from station.diagnosis.report.sentences import sentence
from station.diagnosis.report.summary import summary
from station.diagnosis.report.where import where
from station.diagnosis.result import Diagnosis, EffectFound, Verdict
from station.diagnosis.result_json import as_json
from station.pages.caption import command_line, made_by
from station.pages.drawing import style


@missing_as_user_error()
def diagnose(
    recording: Recording | FilePath,
    *,
    simulation: Any = None,
    rig: FilePath | None = None,
    nested: bool = False,
    seed: int = 1,
    jobs: int = 1,
    progress: Callable[[str], None] = lambda _: None,
) -> Diagnosed:
    """Says where a recording differs from a simulation, which physics that is, and how far modelling it closes the gap.

    It does what `station diagnose` does, and gives the same answer for the same seed.

    Args:
        recording: a recording, or the path of one (.mcap) or of a table of samples (.csv, .parquet).
        simulation: the simulation to compare with: a recording of the same commands or its path, or the name of a
            simulator ("planar", "mujoco"); None: one constant friction.
        rig: the path of a rig file; None: the one inside the recording.
        nested: searches each held-out fold anew, names included, which takes several times as long.
        seed: of the null's draws and the held-out folds.
        jobs: processes that search the folds; with 1 no other process is started.
        progress: is called with a few words before each step.

    Raises:
        UserError: if a file is missing, damaged or of another kind, the simulation is not of these runs, or the seed
            is none.
    """
    asked: dict[str, Any] = {
        "seed": seed_of(seed),
        "simulate": _given(simulation),
        "folding": folds.nested if nested else folds.named,
        "jobs": jobs,
        "status": progress,
    }
    if isinstance(recording, Recording):
        plan = RecordedPlan.of(recording.reader)
        found = diagnose_session(recording.signals, name=recording.name, rig=recording.rig(rig), plan=plan, **asked)
    else:
        found = diagnose_file(path_of(recording), rig=None if rig is None else path_of(rig), **asked)
    return Diagnosed(diagnosis=found.diagnosis, pictures=found.pictures, found=found.found, seed=seed)


def _given(simulation: Any) -> Any:
    """Gives the simulation as the diagnosis takes it: a file or a simulator by its name, and whatever else as it is."""
    if isinstance(simulation, Recording):
        return simulation.name
    return str(simulation) if isinstance(simulation, Path) else simulation


@dataclass(frozen=True, kw_only=True, repr=False)
class Diagnosed(Examined):
    """A diagnosis that shows itself; `diagnosis` has all of its numbers, `pictures` the data of its figures.

    `seed` is the one that it was made with.
    """

    seed: int

    @property
    def verdict(self) -> Verdict:
        """One of "supported", "indistinguishable", "not supported", "untestable"."""
        return self.diagnosis.verdict

    @property
    def sentence(self) -> str:
        """The answer in one sentence."""
        return sentence(self.diagnosis)

    @property
    def effects(self) -> tuple[EffectFound, ...]:
        """The effects that were found, the likeliest first: probability, verdict, and parameters with errors in SI."""
        return self.diagnosis.effects

    @property
    def model(self) -> dict[str, Any]:
        """The findings as the tables of a model.toml; `station.simulate` takes it."""
        return dict(self.diagnosis.model)

    def to_dict(self) -> dict[str, Any]:
        """Returns the same as `station diagnose --json`; a number that does not exist is None."""
        return as_json(self.diagnosis)

    def to_html(self) -> str:
        """Returns the whole report as one page that fetches nothing."""
        return html_page(self.diagnosis, self.pictures, seed=self.seed)

    def write_report(self, path: FilePath) -> None:
        """Writes the report (.html).

        Raises:
            UserError: if the file cannot be written.
        """
        write_text(Path(path), self.to_html(), what="report")

    def write_model(self, path: FilePath) -> None:
        """Writes what was found as a model.toml.

        Raises:
            UserError: if the file cannot be written.
        """
        write_text(Path(path), tomli_w.dumps(self.model), what="model")

    def __repr__(self) -> str:
        """Returns the words that `station diagnose` prints."""
        return as_text([summary(self.diagnosis)])

    def _repr_html_(self) -> str:
        """Returns the answer with its figures, for a notebook."""
        command = command_line("station", "diagnose", self.diagnosis.recording, seed=self.seed)
        with style(), made_by(command):
            return fragment(about(self.diagnosis), headline(self.diagnosis), *_sections(self))


def _sections(found: Diagnosed) -> list[str]:
    diagnosis: Diagnosis = found.diagnosis
    if diagnosis.verdict == "untestable":
        return []
    return [numerics(diagnosis), where(diagnosis, found.pictures), fit(diagnosis, found.pictures)]
