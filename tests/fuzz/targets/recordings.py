"""Recordings: damaged ones, and ones with valid checksums and impossible content, by every command that opens one."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from random import Random

from station.app.commands.replay import setup_for
from station.app.planned import recorded_plan
from station.app.setting import setting_of
from station.app.simulating import rig_of
from station.recording.arrays import load_signals, run_signals
from station.recording.reader import open_recording
from station.recording.repair import repair
from tests.fuzz import seeds
from tests.fuzz.change import of_bytes
from tests.fuzz.rewritten import rewritten
from tests.fuzz.target import Target, Unclear, command


def _seed(random: Random) -> bytes:
    return random.choice((seeds.bench, seeds.session))()


def _damaged(random: Random) -> bytes:
    return of_bytes(random, seeds.bench())


def _rewritten(random: Random) -> bytes:
    return rewritten(random, _seed(random))


def _same_or_said(path: Path) -> None:
    """Whatever byte is changed: the same messages, or a sentence. Metadata that changed is known to have."""
    reader = open_recording(path)
    found = tuple((one.topic, one.payload, one.log_ns, one.publish_ns) for one in reader.messages(truth=True))
    if found != seeds.messages_of(seeds.bench()) and not reader.malformed:
        raise Unclear("other messages than were written, and nobody says so")
    by_columns = reader.samples()
    if by_columns != tuple(one.message for one in reader.messages({"session/sample"})):
        raise Unclear("samples differ between the two ways of reading")
    if (reader.metadata, reader.attachments) != _described() and not reader.changed_metadata:
        raise Unclear("other metadata or files than were written, and nobody says so")


def _described() -> tuple[dict[str, dict[str, str]], dict[str, bytes]]:
    if not _KNOWN:
        from tempfile import TemporaryDirectory  # noqa: PLC0415

        with TemporaryDirectory() as folder:
            path = Path(folder) / "seed.mcap"
            path.write_bytes(seeds.bench())
            reader = open_recording(path)
            _KNOWN.append((reader.metadata, reader.attachments))
    return _KNOWN[0]


_KNOWN: list[tuple[dict[str, dict[str, str]], dict[str, bytes]]] = []


def _read_all(path: Path) -> None:
    """Reads a recording in two ways, which must give the same samples, and times that are times."""
    reader = open_recording(path)
    samples = [one.message for one in reader.messages({"session/sample"}, truth=False)]
    if [repr(one) for one in reader.samples()] != [repr(one) for one in samples]:
        raise Unclear("samples differ between the two ways of reading")
    for item in reader.messages():
        repr(item.message)


REPAIR = command("repair", "{file}")


def _repair(path: Path) -> None:
    """A repair, without the result of the one before in its way: what was written, or a word on what is lost."""
    path.with_suffix("").unlink(missing_ok=True)
    said = repair(path).sentence
    reader = open_recording(path.with_suffix(""))
    found = {(one.topic, one.payload, one.log_ns, one.publish_ns) for one in reader.messages(truth=True)}
    if not found <= set(seeds.messages_of(seeds.bench())):
        raise Unclear("a repair adds messages that nobody wrote")
    others = {name: values for name, values in reader.metadata.items() if name != "repair"}
    same = len(found) == len(set(seeds.messages_of(seeds.bench()))) and (others, reader.attachments) == _described()
    if not same and said.endswith("lost: nothing") and not reader.changed_metadata:
        raise Unclear(f"a repair loses something and does not say so: {said}")


def _repair_rewritten(path: Path) -> None:
    """A repair of what has valid checksums and impossible content, which can be read afterwards."""
    path.with_suffix("").unlink(missing_ok=True)
    REPAIR(path)
    for item in open_recording(path.with_suffix("")).messages():
        repr(item.message)


def _for_diagnosis(path: Path) -> None:
    """Reads what `station diagnose` reads before it thinks."""
    reader = open_recording(path)
    rig_of(reader)
    recorded_plan(reader)
    load_signals(reader)
    for _ in run_signals(reader):
        pass


_SIMULATE = command("simulate", "{file}", "--out", "simulated.mcap")


def _simulate(path: Path) -> None:
    """The session again in simulation, without the one before in its way."""
    path.with_name("simulated.mcap").unlink(missing_ok=True)
    _SIMULATE(path)


def _for_replay(path: Path) -> None:
    """Reads what `station replay` reads before it draws."""
    reader = open_recording(path)
    setup_for(reader, rig_path=None)
    setting_of(rig_of(reader))


TARGETS = (
    Target("recording: bytes", ".mcap", _damaged, _same_or_said, share=4.0),
    Target("recording: read", ".mcap", _rewritten, _read_all, share=4.0),
    Target("recording: samples", ".mcap", _rewritten, command("samples", "{file}", "--csv", "out.csv"), share=1.0),
    Target("recording: doctor", ".mcap", _rewritten, command("doctor", "{file}"), share=1.5),
    Target("recording: doctor json", ".mcap", _rewritten, command("doctor", "--json", "{file}"), share=0.7),
    Target("recording: check", ".mcap", partial(_rewritten), command("check", "{file}"), share=1.5),
    Target("recording: verify", ".mcap", partial(_rewritten), command("verify", "{file}"), share=1.0),
    Target("recording: diagnose", ".mcap", _rewritten, _for_diagnosis, share=2.0),
    Target("recording: diagnose all", ".mcap", partial(_rewritten), command("diagnose", "{file}"), share=0.5),
    Target("recording: simulate", ".mcap", _rewritten, _simulate, share=0.5),
    Target("recording: replay", ".mcap", _rewritten, _for_replay, share=1.5),
    Target("recording: analyze", ".mcap", _rewritten, command("analyze", "{file}", "--out", "analysis"), share=0.2),
    Target("recording: repair", ".mcap.partial", _damaged, _repair, share=0.7),
    Target("recording: repair rewritten", ".mcap.partial", _rewritten, _repair_rewritten, share=0.7),
)
