"""Writes a recording anew from what can be read of it, and copies recordings with some topics left out."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from mcap.records import Attachment, Channel

from shared.errors import UserError
from station.recording.claim import Claim
from station.recording.counts import METADATA as COUNTS
from station.recording.disk import ReservedFile, being_written, reserve_path
from station.recording.malformed import counted
from station.recording.mcap_file import McapFile
from station.recording.names import give_free_name
from station.recording.provenance import sealed
from station.recording.salvage import Block, Findings, Salvage
from station.recording.writer import PARTIAL


@dataclass(frozen=True, slots=True)
class Repaired:
    """The outcome of a repair."""

    source: Path
    path: Path
    findings: Findings

    @property
    def sentence(self) -> str:
        """One line for the log."""
        found = self.findings
        counts = {
            "bytes of an unfinished record at the end": found.lost_bytes,
            "damaged records": found.bad_records,
            "records of an unknown kind": found.unknown_records,
            "chunks that claim to hold far more than measurements packed in such a file": found.bombs,
            "messages whose topic was defined in a damaged record": found.unknown_messages,
        }
        lost = ", ".join(f"{count} {what}" for what, count in counts.items() if count)
        nothing = "nothing that can be told, as the file was never finished" if found.cut_off else "nothing"
        said = f"{self.path}: {found.messages} messages saved; lost: {lost or nothing}"
        if not found.malformed:
            return said
        return f"{said}; saved as they are, but left out by every reader: {counted(found.malformed)}"


def repaired_path(path: Path) -> Path:
    """Returns the name of what is saved from `path`: without `.partial`, or `NAME.repaired.mcap`."""
    return path.with_suffix("") if path.suffix == PARTIAL else path.with_suffix(".repaired.mcap")


def repair(path: Path, *, out: Path | None = None) -> Repaired:
    """Saves all that can be read of a recording, with metadata and attachments; removes the partial file it replaces.

    Raises:
        UserError: if nothing can be read, somebody is still writing the file, or the new name is taken.
    """
    target = out or repaired_path(path)
    if not path.is_file():
        raise UserError(f"Expected a recording to repair, but there is no file {path}")
    if being_written(path):
        raise UserError(f"Expected a recording that nobody writes any more, but a session is still writing {path}")
    with Claim(target):
        if target.exists():
            raise UserError(f"Expected to save the recording as {target}, but that exists; choose a name with --out")
        salvage = Salvage(path)
        target = give_free_name(_rewrite(salvage, target, keep=lambda _: True, note=path.name), target)
        if path.suffix == PARTIAL and out is None:
            path.unlink()
            reserve_path(path).unlink(missing_ok=True)
    return Repaired(path, target, salvage.findings)


def repair_folder(folder: Path) -> tuple[Repaired, ...]:
    """Repairs every partial recording of a folder that nobody writes; those that hold nothing readable stay."""
    done: list[Repaired] = []
    for path in sorted(folder.glob(f"*.mcap{PARTIAL}")):
        if being_written(path) or repaired_path(path).exists():
            continue
        try:
            done.append(repair(path))
        except UserError:
            continue  # not an MCAP file: its owner may still want to look at it
    return tuple(done)


def copy_without(source: Path, target: Path, *, drop: Callable[[str], bool]) -> None:
    """Copies a recording without the topics (named as on the bus) for which `drop` is true."""
    with Claim(target):
        unfinished = _rewrite(
            Salvage(source), target, keep=lambda channel: not drop(channel.topic.removeprefix("/")), note=""
        )
        os.replace(unfinished, target)


def _rewrite(salvage: Salvage, target: Path, *, keep: Callable[[Channel], bool], note: str) -> Path:
    """Returns the new file, which is still to be named."""
    unfinished = target.with_name(target.name + ".repairing")
    file = ReservedFile(unfinished)
    try:
        output = McapFile(file, library="repose")
        _copy(salvage, output, keep, counting=bool(note))
        if note:
            output.add_metadata("repair", sealed(_note(note, salvage.findings)))
        output.finish()
        file.sync()
    except BaseException:
        file.close()
        unfinished.unlink(missing_ok=True)
        raise
    file.close()
    return unfinished


def _copy(salvage: Salvage, output: McapFile, keep: Callable[[Channel], bool], *, counting: bool) -> None:
    channels = _Channels(salvage, output, keep)
    for item in salvage.read():
        if isinstance(item, Block):
            for raw in item.messages:
                if counting:
                    salvage.count_malformed(raw)
                if number := channels.number(raw.channel_id):
                    output.add_message(
                        number,
                        log_ns=raw.log_ns,
                        publish_ns=raw.publish_ns,
                        sequence=raw.sequence,
                        payload=raw.payload,
                    )
        elif isinstance(item, Attachment):
            output.add_attachment(item.name, item.data, media_type=item.media_type, stamp_ns=item.log_time)
        elif counting or item.name != COUNTS:  # a copy without some topics is not what was counted
            output.add_metadata(item.name, item.metadata)


class _Channels:
    """The new numbers of channels, given at their first message; 0 for those that are not kept."""

    def __init__(self, salvage: Salvage, output: McapFile, keep: Callable[[Channel], bool]) -> None:
        self._salvage = salvage
        self._output = output
        self._keep = keep
        self._numbers: dict[int, int] = {}
        self._schemas: dict[int, int] = {0: 0}

    def number(self, old: int) -> int:
        if old not in self._numbers:
            channel = self._salvage.channels[old]
            self._numbers[old] = self._register(channel) if self._keep(channel) else 0
        return self._numbers[old]

    def _register(self, channel: Channel) -> int:
        if channel.schema_id not in self._schemas:
            schema = self._salvage.schemas[channel.schema_id]
            self._schemas[channel.schema_id] = self._output.register_schema(
                schema.name, schema.data, encoding=schema.encoding
            )
        schema_id = self._schemas[channel.schema_id]
        return self._output.register_channel(channel.topic, schema_id=schema_id, encoding=channel.message_encoding)


def _note(name: str, findings: Findings) -> dict[str, str]:
    return {
        "from": name,
        "messages": str(findings.messages),
        "bad_records": str(findings.bad_records),
        "unknown_records": str(findings.unknown_records),
        "bombs": str(findings.bombs),
        "unknown_messages": str(findings.unknown_messages),
        "malformed": str(sum(findings.malformed.values())),
        "lost_bytes": str(findings.lost_bytes),
    }
