"""A recording is a stranger's data: nothing that it carries is loaded or run, and what it names is told."""

from __future__ import annotations

import io
import shutil
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import pytest
from mcap.reader import McapReader, make_reader
from mcap.records import Channel, Message, Schema
from mcap.writer import Writer

import station
from shared.config import Table
from shared.errors import UserError
from shared.rig import load_rig
from station.__main__ import main
from station.app import analysis_files, assembly
from station.app.attached import attached_rig, attached_table, effects_left_out, planted_in, planted_in_recording
from station.app.summary import print_summary
from station.friction.figures import figure_kinds
from station.recording.for_viewers import for_viewers
from station.recording.reader import open_recording
from station.rig.arm_model import MODELS
from station.rig.placed_arm import placed_arm
from station.simulators.mujoco.pairs import PAIRS

GOLDEN = Path(__file__).parents[2] / "golden" / "session.mcap"
TRAP = "from pathlib import Path\nPath('sprung').touch()\n"
EFFECTS = '\n[physics]\neffects = [".", "{here}"]\n[plugins]\nfolders = [".", "{here}"]\n'
COMMANDS = (
    ("diagnose", "{file}"),
    ("diagnose", "{file}", "--simulate", "trap"),
    ("import", "trap", "{file}", "--out", "imported.mcap"),
    ("simulate", "{file}", "--model", "model.toml", "--out", "simulated.mcap"),
    ("check", "{file}"),
    ("replay", "{file}", "--no-viewer", "--save", "view.rrd"),
    ("doctor", "{file}"),
    ("samples", "{file}"),
)


@cache
def golden() -> tuple[McapReader, list[tuple[Schema | None, Channel, Message]]]:
    """The golden session's reader and its messages, unpacked once for the forty recordings that are made of them."""
    reader = make_reader(io.BytesIO(GOLDEN.read_bytes()))
    return reader, list(reader.iter_messages())


def forged(path: Path, *, more: str = "", rig: bytes | None = None, rig_id: str = "") -> Path:
    """The golden session with `more` behind its rig file, or with another `rig` of the id `rig_id` in its place."""
    reader, messages = golden()
    with path.open("wb") as target:
        writer = Writer(target)
        writer.start()
        topics: dict[int, int] = {}
        for schema, channel, message in messages:
            assert schema is not None
            if channel.id not in topics:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                topics[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, number)
            writer.add_message(topics[channel.id], message.log_time, message.data, message.publish_time)
        for one in reader.iter_attachments():
            text = (rig or one.data + more.encode()) if one.name == "rig.toml" else one.data
            writer.add_attachment(one.create_time, one.log_time, one.name, one.media_type, text)
        for one in reader.iter_metadata():
            writer.add_metadata(
                one.name, one.metadata | ({"rig_id": rig_id} if rig_id and "rig_id" in one.metadata else {})
            )
        writer.finish()
    return path


@pytest.fixture
def trapped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A recording whose rig file names the folder in which the user stands, where a file waits to be imported."""
    monkeypatch.chdir(tmp_path)
    for folder in (tmp_path, tmp_path / "importers", tmp_path / "simulators"):
        folder.mkdir(exist_ok=True)
        (folder / "trap.py").write_text(TRAP)
    (tmp_path / "model.toml").write_text("[friction]\nmu_s = 0.3464\n")
    return forged(tmp_path / "stranger.mcap", more=EFFECTS.format(here=tmp_path))


@pytest.mark.parametrize("words", COMMANDS, ids=[" ".join(words[::2]) for words in COMMANDS])
def test_opening_a_recording_runs_nothing(trapped: Path, words: tuple[str, ...]) -> None:
    main([word.format(file=trapped) for word in words])
    assert not (trapped.parent / "sprung").exists()


def test_what_was_not_loaded_is_told(trapped: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["diagnose", str(trapped), "--json"]) == 0
    told = capsys.readouterr().err
    assert "nothing that a recording names is loaded" in told
    assert "--rig" in told
    assert effects_left_out(open_recording(trapped)) == (".", str(trapped.parent))


def test_ones_own_rig_file_loads_its_effects(trapped: Path) -> None:
    """The trap is no effect, but it is imported: the user's own file asked for it."""
    rig = attached_table(open_recording(GOLDEN), "rig.toml")
    assert rig is not None
    own = trapped.parent / "own.toml"
    own.write_text(rig.text + EFFECTS.format(here=trapped.parent))
    assert main(["diagnose", str(trapped), "--rig", str(own)]) == 2
    assert (trapped.parent / "sprung").exists()


@pytest.mark.parametrize("command", ["check", "doctor", "samples"])
def test_a_recording_of_a_rig_with_any_id_is_read(
    tmp_path: Path, command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Rig files of the user's own have plain ids; a recording is data, and may be older than that."""
    own = attached_table(open_recording(GOLDEN), "rig.toml")
    assert own is not None
    name = '<b>the "lab"</b>/1'
    text = "\n".join(f"id = '{name}'" if line.startswith("id =") else line for line in own.text.splitlines())
    path = forged(tmp_path / "older.mcap", rig=text.encode(), rig_id=name)
    rig = attached_rig(open_recording(path))
    assert rig is not None
    assert rig.id == name
    assert main([command, str(path)]) == main([command, str(GOLDEN)])
    assert "Traceback" not in capsys.readouterr().err


def naming(path: Path, table: str, key: str, file: str) -> Path:
    """The golden session whose rig file names `file`, a TOML's path, under a key of `table`."""
    rig = attached_table(open_recording(GOLDEN), "rig.toml")
    assert rig is not None
    lines = [line for line in rig.text.splitlines() if not line.startswith(f"{key} =")]
    lines.insert(lines.index(f"[{table}]") + 1, f'{key} = "{file}"')
    return forged(path, rig="\n".join(lines).encode())


@pytest.mark.parametrize("file", ["{here}/bait.toml", "bait.toml", "../../../bait", "{here}/bait"])
@pytest.mark.parametrize("command", ["check", "verify", "replay", "doctor", "diagnose", "samples"])
def test_opening_a_recording_opens_no_model_that_it_names(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str, file: str, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    opened = watched(monkeypatch)
    (tmp_path / "bait.toml").write_text("x = 1\n")
    path = naming(tmp_path / "stranger.mcap", "arm", "model", file.format(here=tmp_path))
    more = ("--no-viewer", "--save", "view.rrd") if command == "replay" else ()
    status = main([command, str(path), *more])
    assert not [name for name in opened if "bait" in name]
    told = capsys.readouterr()
    assert command != "check" or (status == 2 and "only a rig file on disk may name a file" in told.err)


def watched(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The paths that are looked at or read as text from now on."""
    opened, is_file, read_text = list[str](), Path.is_file, Path.read_text

    def looks(path: Path, **how: bool) -> bool:
        opened.append(str(path))
        return is_file(path, **how)

    def reads(path: Path, *how: str, **named: str) -> str:
        opened.append(str(path))
        return read_text(path, *how, **named)

    monkeypatch.setattr(Path, "is_file", looks)
    monkeypatch.setattr(Path, "read_text", reads)
    return opened


def test_the_twin_of_a_recordings_rig_opens_no_pair_that_it_names(tmp_path: Path) -> None:
    rig = attached_rig(open_recording(naming(tmp_path / "a.mcap", "twin", "pair", str(tmp_path / "bait.toml"))))
    assert rig is not None
    with pytest.raises(UserError, match=r"for 'twin\.pair', got '.*bait\.toml'"):
        assembly.twin_world(rig, seed=1, start_ns=0)


def test_ones_own_rig_file_names_its_arm_and_pair(tmp_path: Path) -> None:
    shutil.copy(MODELS / "jaco2_spherical.toml", tmp_path / "mine.toml")
    shutil.copy(PAIRS / "steel_on_steel.toml", tmp_path / "pair.toml")
    own = tmp_path / "rig.toml"
    own.write_text(
        f'id = "own"\n[arm]\nmodel = "{tmp_path / "mine.toml"}"\n[twin]\npair = "{tmp_path / "pair.toml"}"\n'
    )
    rig = load_rig(own)
    assert placed_arm(rig).model.joints
    assembly.twin_world(rig, seed=1, start_ns=0)


def test_a_file_of_that_name_here_makes_no_strangers_rig_ones_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Viewers and converters know a recording's rig by its text alone; a folder of recordings often has a rig.toml."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(MODELS / "jaco2_spherical.toml", tmp_path / "mine.toml")
    text = 'id = "one"\n[arm]\nmodel = "mine.toml"\n'
    (tmp_path / "rig.toml").write_text(text)
    assert for_viewers(text) is None
    assert for_viewers(text, own=load_rig(tmp_path / "rig.toml").arm.own) is not None


def test_a_session_of_ones_own_arm_is_checked_with_ones_own_rig_file(tmp_path: Path) -> None:
    recorded = naming(tmp_path / "mine.mcap", "arm", "model", "mine.toml")
    shutil.copy(MODELS / "jaco2_spherical.toml", tmp_path / "mine.toml")
    rig = attached_table(open_recording(recorded), "rig.toml")
    assert rig is not None
    own = tmp_path / "rig.toml"
    own.write_text(rig.text.replace("mine.toml", str(tmp_path / "mine.toml")))
    assert main(["check", str(recorded)]) == 2
    assert main(["check", str(recorded), "--rig", str(own)]) == 0


@pytest.mark.parametrize(
    "words", [("import", "trap", "x.txt", "--check"), ("diagnose", "{file}", "--simulate", "trap")]
)
def test_ones_own_rig_file_loads_its_plugins(trapped: Path, words: tuple[str, ...]) -> None:
    own = trapped.parent / "own.toml"
    own.write_text('id = "own"\n[plugins]\nfolders = ["."]\n')
    assert main([*(word.format(file=trapped) for word in words), "--rig", str(own)]) == 2
    assert (trapped.parent / "sprung").exists()


def test_a_recording_without_a_rig_file_has_none(tmp_path: Path) -> None:
    reader = open_recording(GOLDEN)
    assert attached_table(reader, "nothing.toml") is None
    assert effects_left_out(reader) == ()
    rig = attached_rig(reader)
    assert rig is not None
    assert rig.physics.values == {}
    other = attached_rig(open_recording(forged(tmp_path / "other.mcap", more='\n[plugins]\nfolders = ["x"]\n')))
    assert other is not None
    assert other.plugins.values == {}


@pytest.mark.parametrize("rig", [b"\xff\xfe", b"not = [toml"])
def test_a_rig_file_that_is_none_is_one_sentence(tmp_path: Path, rig: bytes) -> None:
    reader = open_recording(forged(tmp_path / "odd.mcap", rig=rig))
    with pytest.raises(UserError, match=r"rig\.toml in .*odd\.mcap: expected TOML, got something else"):
        attached_rig(reader)


@pytest.mark.parametrize("words", [("diagnose",), ("plan",), ("simulate", "--out", "again.mcap")])
@pytest.mark.parametrize(
    "table", ["[block]\nsize_m = [1e308, 1e-308, 1e308]", "[block]\nmass_kg = inf", "[camera]\npx_per_mm = 1e-300"]
)
def test_sizes_whose_squares_are_no_numbers_are_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: tuple[str, ...], table: str
) -> None:
    path = forged(tmp_path / "odd.mcap", rig=f'id = "odd"\n{table}\n'.encode())
    assert main([words[0], str(path), *words[1:]]) == 2
    assert "of 1e-09 to 1e+09" in capsys.readouterr().err


def test_what_a_rig_conceals_is_not_in_a_simulation_of_its_session(tmp_path: Path) -> None:
    """A diagnosis of a simulation must not be told that a camera's mount sags, which nobody simulated."""
    simulated = tmp_path / "simulated.mcap"
    assert main(["simulate", str(GOLDEN), "--plant", "kinetic_drop=0.3", "--out", str(simulated)]) == 0
    recorded, again = (attached_rig(open_recording(path)) for path in (GOLDEN, simulated))
    assert recorded is not None
    assert "sags" in recorded.planted
    assert again is not None
    assert not again.planted


def test_what_a_simulated_rig_conceals_is_announced_wherever_its_session_is_shown(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """One figure of each report is drawn, and not all: the words stand above them."""
    one_figure = partial(analysis_files.draw_figures, names=[figure_kinds()[0].name])
    monkeypatch.setattr(analysis_files, "draw_figures", one_figure)
    monkeypatch.chdir(tmp_path)
    rig = b'planted = "its floor is warm"\n' + _without_planted(open_recording(GOLDEN).attachments["rig.toml"])
    path = forged(tmp_path / "planted.mcap", rig=rig)
    print_summary(path)
    shown = [capsys.readouterr().out]
    for words in (
        *(["doctor", str(path)], ["analyze", str(path)], ["analyze", "*.mcap"], ["samples", str(path)]),
        *(["samples", str(path), "--json"], ["export", str(path)]),
    ):
        main(words)
        shown.append(capsys.readouterr().out)
    shown.append(repr(station.open(path)))
    shown.append(station.open(path)._repr_html_())  # pyright: ignore[reportPrivateUsage]
    assert [one.count("its floor is warm") for one in shown] == [1] * 9
    assert (tmp_path / "analysis" / "report.html").read_text("utf-8").count("its floor is warm") == 1


def test_a_sag_is_told_in_mm_at_a_tilt_that_is_reached() -> None:
    """The law of the effect gives 12 px × sin(20°) = 4.1 px, half a mm with 8 px/mm; the mark is 3 % nearer."""
    rig = load_rig(assembly.simulated_rig_path())
    finer = replace(rig, camera=replace(rig.camera, px_per_mm=8.0))
    (said,), (said_finer,) = planted_in(rig), planted_in(finer)
    assert "12 px when the plate is upright" in said
    assert said.endswith("(at 20° the picture moves by 4.1 px, 0.66 mm at the height of the block's mark)")
    assert said_finer.endswith("4.1 px, 0.50 mm at the height of the block's mark)")


@pytest.mark.parametrize("sag_px", [0.0, float("nan"), float("inf"), 10**400, "much", [1.0]])
def test_a_sag_that_is_none_is_not_told(sag_px: object) -> None:
    rig = load_rig(assembly.simulated_rig_path())
    camera = replace(rig.camera, options=Table({"sag_px": sag_px}))
    assert planted_in(replace(rig, camera=camera)) == (f"the rig is a simulation: {rig.planted}",)


def test_a_rig_that_cannot_be_read_announces_nothing(tmp_path: Path) -> None:
    path = forged(tmp_path / "broken.mcap", rig=b"planted = [")
    assert planted_in_recording(open_recording(path)) == ()


def _without_planted(rig: bytes) -> bytes:
    return b"\n".join(line for line in rig.splitlines() if not line.startswith(b"planted"))
