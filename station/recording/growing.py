"""One file of a recording while it is written: it begins, ends and names itself, and says what is left where it cannot.

It is called `NAME.mcap.partial` while it grows, and `NAME.mcap` once it is closed.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from shared.errors import UserError
from station.recording.disk import RESERVE_BYTES, ReservedFile
from station.recording.mcap_file import McapFile
from station.recording.names import Names
from station.recording.parts import METADATA, partial_path
from station.recording.provenance import Provenance, sealed


class GrowingFile:
    """A file with all that it takes to be read alone; messages go into its `mcap`."""

    def __init__(self, path: Path, provenance: Provenance, *, part: Mapping[str, str]) -> None:
        """Begins the file that grows beside `path`, with where it comes from and which `part` it is, if any.

        Raises:
            UserError: if it cannot be written; it is taken away then.
        """
        self.unfinished = partial_path(path)
        self._file = ReservedFile(self.unfinished, reserve_bytes=RESERVE_BYTES)
        try:
            self.mcap = McapFile(self._file, library=f"repose {provenance.versions.get('repose', '')}")
            self._describe(provenance, part)
        except OSError as error:
            self._file.discard()
            raise UserError(
                f"Expected to record into {path}, but it cannot be written ({error.strerror}); free some space"
            ) from error

    def _describe(self, provenance: Provenance, part: Mapping[str, str]) -> None:
        self.add_metadata("session", provenance.session())
        self.add_metadata("versions", provenance.versions)
        for file in provenance.files():
            self.mcap.add_attachment(file.name, file.data, media_type=file.media_type, stamp_ns=provenance.started_ns)
        if part:
            self.add_metadata(METADATA, part)

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Adds a record of names and values with a checksum; raises OSError if there is no room for it."""
        self.mcap.add_metadata(name, sealed(values))

    @property
    def full(self) -> bool:
        """True once the disk has run full: the file can be ended, and no more."""
        return self._file.full

    @property
    def size_bytes(self) -> int:
        """The bytes written so far."""
        return self._file.tell()

    def finish(self, last: Mapping[str, Mapping[str, str]], *, names: Names, path: Path) -> tuple[Path, str]:
        """Ends the file with its `last` metadata records and names it `path`, if nobody else has that name meanwhile.

        Returns its name, and nothing or a sentence if that failed.
        """
        try:
            for name, values in last.items():
                self.add_metadata(name, values)
            self.mcap.finish()
            self._file.sync()
            self._file.close()
            return names.give(self.unfinished, path), ""
        except OSError as error:
            return path, self.break_off(error)

    def break_off(self, error: OSError) -> str:
        """Closes the file as it is; returns a sentence on where it is and what to do."""
        self._file.close()
        return (
            f"The recording broke off ({error.strerror}): what was written is in {self.unfinished}; "
            f"free some space and run: station repair {self.unfinished}"
        )

    def let_go(self) -> None:
        """Closes the file here alone: another process, born from this one, goes on with it."""
        self._file.let_go()
