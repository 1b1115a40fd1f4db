"""Users write these and keep them beside a recording: rig, plan, calibration and model files, rights, signatures."""

from __future__ import annotations

import json
import tomllib
from functools import cache, partial
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

import tomli_w

from pi_agent.calibration.model import nominal
from pi_agent.calibration.store import load_calibration, write_calibration
from shared.bus_keys import members_in
from shared.bus_rights import ROLES, access_control
from shared.config import Table
from shared.rig import load_rig
from station.app import assembly
from station.app.authority import new_authority
from station.app.recordings import plan_toml
from station.app.setting import setting_of
from station.app.signature import file_sha256, signature_path
from station.app.signing import sign, signature_of
from station.physics.catalogue import catalogue_of_table
from station.recording.for_viewers import for_viewers
from station.sampling.plan import Plan, load_plan
from station.view.setup import setup_of
from tests.fuzz.change import of_bytes, of_table, of_text
from tests.fuzz.target import Target, command

EXAMPLE = Path(__file__).parents[3] / "deploy" / "rig.example.toml"
MODEL = """\
[friction]
mu_s = 0.36
[effects.kinetic_drop]
drop = 0.2
[effects.plate_anisotropy]
cos2 = 0.1
sin2 = 0.05
"""


@cache
def _rig_texts() -> tuple[bytes, ...]:
    return assembly.simulated_rig_path().read_bytes(), EXAMPLE.read_bytes()


@cache
def _calibration() -> bytes:
    rig = assembly.rig_from(None)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "calibration.toml"
        write_calibration(nominal(rig, width_px=600, height_px=600), path)
        return path.read_bytes()


def _toml(texts: tuple[bytes, ...], random: Random) -> bytes:
    """A text changed as a text, or its values replaced."""
    text = random.choice(texts)
    if random.random() < 0.5:
        return of_text(random, text)
    table = of_table(random, _plain(tomllib.loads(text.decode())))
    try:
        return tomli_w.dumps(table).encode()
    except (TypeError, ValueError, UnicodeError, AttributeError, RecursionError):
        return of_text(random, text)


def _plain(value: Any) -> Any:
    return json.loads(json.dumps(value, default=str))


def _read_rig(path: Path) -> None:
    """Everything that a command makes of a rig file before it starts anything."""
    rig = load_rig(path)
    assembly.arm_settings(rig)
    assembly.specimen(rig)
    assembly.nominal_geometry(rig)
    setting_of(rig)
    setup_of(rig)
    catalogue_of_table(Table({}) if "effects" in rig.physics.values else rig.physics)
    for_viewers(rig.text)
    assembly.sampling_machine(rig, Plan(samples=1), tilter=None)


def _read_calibration(path: Path) -> None:
    load_calibration(path)


def _read_plan(path: Path) -> None:
    plan_toml(load_plan(path))


def _read_rights(path: Path) -> None:
    access_control("lab", members_in(path, "lab"))


@cache
def _signed() -> tuple[bytes, Path]:
    """A signature, and the folder of the keys that made it."""
    folder = Path(_KEPT.name)
    (folder / "rig.toml").write_text('id = "lab"\n', encoding="utf-8")
    new_authority(load_rig(folder / "rig.toml"), folder / "keys")
    (folder / "a.mcap").write_bytes(b"content")
    return sign(folder / "a.mcap", folder / "keys", now_ns=1_700_000_000_000_000_000).read_bytes(), folder


_KEPT = TemporaryDirectory()


def _signature(random: Random) -> bytes:
    text = _signed()[0]
    if random.random() < 0.4:
        return of_text(random, text)
    return json.dumps(of_table(random, json.loads(text))).encode()


def _read_signature(path: Path) -> None:
    folder = _signed()[1]
    recording = folder / "b.mcap"
    recording.write_bytes(b"content")
    signature_path(recording).write_bytes(path.read_bytes())
    signature_of(recording, sha256=file_sha256(recording), keys=folder / "keys")


def _certificate(random: Random) -> bytes:
    return of_bytes(random, (_signed()[1] / "keys" / "station" / "cert.pem").read_bytes())


def _read_certificate(path: Path) -> None:
    """A certificate of the user's own that is damaged, as the station's and as the authority's."""
    folder = _signed()[1]
    own = folder / "own"
    own.mkdir(exist_ok=True)
    (own / "key.pem").write_bytes((folder / "keys" / "station" / "key.pem").read_bytes())
    (own / "key.pem").chmod(0o600)
    (own / "cert.pem").write_bytes(path.read_bytes())
    sign(folder / "a.mcap", own, now_ns=1)


def _read_authority(path: Path) -> None:
    folder = _signed()[1]
    (folder / "theirs").mkdir(exist_ok=True)
    (folder / "theirs" / "ca.pem").write_bytes(path.read_bytes())
    signature_of(folder / "a.mcap", sha256=file_sha256(folder / "a.mcap"), keys=folder / "theirs")


def _rights() -> tuple[bytes, ...]:
    return (tomli_w.dumps({"rig": "lab", "members": {role: [f"{role}.1"] for role in ROLES}}).encode(),)


TARGETS = (
    Target("rig.toml", ".toml", lambda random: _toml(_rig_texts(), random), _read_rig, share=2.0),
    Target("plan.toml", ".toml", partial(_toml, (plan_toml(Plan()).encode(),)), _read_plan, share=2.0),
    Target("calibration.toml", ".toml", lambda random: _toml((_calibration(),), random), _read_calibration),
    Target(
        "model.toml",
        ".toml",
        partial(_toml, (MODEL.encode(),)),
        command("export", "{file}", "--format", "numpy", "--out", "model", "--overwrite"),
        share=1.5,
    ),
    Target("rights.toml", ".toml", lambda random: _toml(_rights(), random), _read_rights, share=1.0),
    Target("signature", ".sig", _signature, _read_signature, share=1.5),
    Target("certificate", ".pem", _certificate, _read_certificate, share=0.7),
    Target("authority", ".pem", _certificate, _read_authority, share=0.7),
)
