"""Importers turn other people's measurements into recordings. Each is one file here, found by being here.

One of the user's own is a file in a folder of the user's; README.md of this folder shows one. An importer has

    NAME = "cube-tosses"                      # as in `station import cube-tosses`
    HELP = "one line"
    def read(source: Path, *, onset: Traced | None = None) -> Imported: ...   # raises UserError for a wrong source
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from traceback import extract_tb
from typing import Protocol, cast

from shared.errors import UserError
from shared.messages import Message
from shared.own_module import module_in
from station.recording.provenance import Provenance
from station.recording.writer import Recording
from station.signals.traced import Traced

Item = tuple[str, int, Message]
"""Topic, receive time (ns) and message."""


@dataclass(frozen=True, kw_only=True)
class Imported:
    """The result of an importer: where it comes from, and the messages in order of their receive time.

    `notes` has one line for each thing that is to be told in any case, and `lacking` one for each that the source could
    say and does not.
    """

    provenance: Provenance
    messages: Iterable[Item]
    notes: tuple[str, ...] = ()
    lacking: tuple[str, ...] = ()


class Importer(Protocol):
    """One file of this folder."""

    NAME: str
    HELP: str

    def read(self, source: Path, *, onset: Traced | None = None) -> Imported:
        """Reads a foreign file; where it has slides and no onsets, `onset` estimates these."""
        ...


def importers(files: Iterable[Path] = ()) -> dict[str, Importer]:
    """Returns every importer by its name: ours, then those in files of the user's own.

    Raises:
        UserError: if a file cannot be imported or is no importer, or a name comes twice.
    """
    modules = (importlib.import_module(f"{__name__}.{found.name}") for found in pkgutil.iter_modules(__path__))
    found = {importer.NAME: importer for importer in (cast(Importer, module) for module in modules)}
    for file in files:
        own = OwnImporter(file)
        if own.NAME in found:
            raise UserError(f"Expected every importer once, but {own.NAME} comes again from {file}; rename one of them")
        found[own.NAME] = own
    return found


class OwnImporter:
    """An importer in a file of the user's own, whose faults are told in one sentence each."""

    def __init__(self, file: Path) -> None:
        """Imports the file, which runs it.

        Raises:
            UserError: if that fails, or it is no importer.
        """
        self._file = file
        with self._errors_in_words("be imported"):
            module = module_in(file, name=f"repose_user_importers.{file.stem}")
        self.NAME, self.HELP = str(getattr(module, "NAME", "")), str(getattr(module, "HELP", ""))
        self._read = getattr(module, "read", None)
        if not (self.NAME and self.HELP and callable(self._read)):
            raise UserError(f"Expected NAME, HELP and a function read in the importer {file}, found not all of them")

    def read(self, source: Path, *, onset: Traced | None = None) -> Imported:
        """Reads a foreign file as `Importer.read` does; raises UserError for whatever goes wrong in it."""
        assert self._read is not None
        with self._errors_in_words(f"read {source}"):
            found = self._read(source, onset=onset)
        if not isinstance(found, Imported):
            raise UserError(f"Expected an Imported from read in {self._file}, got {type(found).__name__}")
        return replace(found, messages=self._messages(found))

    def _messages(self, found: Imported) -> Iterator[Item]:
        with self._errors_in_words("give its messages"):
            yield from found.messages

    @contextmanager
    def _errors_in_words(self, what: str) -> Generator[None]:
        try:
            yield
        except (UserError, GeneratorExit):
            raise
        except Exception as error:
            lines = [frame.lineno for frame in extract_tb(error.__traceback__) if frame.filename == str(self._file)]
            where = f", line {lines[-1]}" if lines else ""
            said = " ".join(f"{type(error).__name__}: {error}".split())
            raise UserError(f"Expected the importer {self._file} to {what}, but it failed{where}: {said}") from error


def write(imported: Imported, path: Path, *, overwrite: bool = False) -> int:
    """Writes what was imported as a recording; gives the number of messages.

    Raises:
        UserError: if the recording exists or cannot be written, or the source turns out to be wrong on the way.
    """
    count = 0
    with Recording(path, provenance=imported.provenance, overwrite=overwrite) as recording:
        for topic, receive_ns, message in imported.messages:
            recording.write_message(topic, message, receive_ns=receive_ns)
            count += 1
    return count
