"""A demonstration: a session with a concealed effect, its diagnosis, and whether that was right.

The session is one of the simulated rig, whose camera is mounted firmly here. The planar simulator, which has the laws
of the catalogue, repeats its commands with one effect that is drawn at random or given. What was drawn goes into a key
file with a random word, and the file's hash is told before the session is simulated.
"""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tomli_w

from shared.clock import SIMULATION_EPOCH_NS
from shared.config import Table, load_table
from shared.rig import RigConfig, rig_of_table
from station.app import assembly, recordings
from station.app.lockstep import Lockstep
from station.app.same_session import same
from station.app.simulated_recording import write_simulated
from station.diagnosis.report.sentences import PATH_ERROR, untestable_because
from station.diagnosis.result import Diagnosis, EffectFound, Value, read_name
from station.physics.catalogue import Catalogue, confused
from station.physics.model import Model, Term, table_of_model
from station.recording.arrays import load_signals
from station.recording.reader import open_recording
from station.recording.writer import Recording
from station.simulators.simulator import simulator

LARGER = 1.3
"""Factor by which a drawn effect is at most larger than what its file says is shown: key and answer are not known."""

PLAIN = Model(mu_s=0.36, scatter=0.06)
"""Steel on steel, as the paper found it, with the scatter between the runs of one direction."""

SURE = 2.0
"""Standard errors from nothing from which on a size that was found is shown."""

OUTSIDE = "something outside the catalogue"


@dataclass(frozen=True, kw_only=True)
class Sealed:
    """The key file, which says what will be concealed, and its hash."""

    key: Path
    sha256: str


@dataclass(frozen=True, kw_only=True)
class Concealed:
    """The recording, and whether anything in it is other than it would be without the concealed effect."""

    recording: Path
    shows: bool


def drawn(known: Catalogue, rng: np.random.Generator) -> Model:
    """Returns the plain model with one effect, drawn among those that a session of this length shows.

    Its size and sign are drawn as well.
    """
    able = [known[name] for name in sorted(known) if known[name].demonstrated]
    effect = able[rng.integers(len(able))]
    values = effect.neutral()
    for size in effect.parameters:
        sign = rng.choice([-1.0, 1.0]) if size.low < 0.0 else 1.0
        if size.name in effect.demonstrated:
            values[size.name] = size.clipped(sign * rng.uniform(1.0, LARGER) * effect.demonstrated[size.name])
    return PLAIN.with_term(Term(effect, values))


def seal(model: Model, folder: Path, rng: np.random.Generator) -> Sealed:
    """Writes the model, with a random word that keeps the hash from being guessed, into the key file in `folder`."""
    key = folder / "key.toml"
    text = tomli_w.dumps({"about": {"word": rng.bytes(16).hex()}} | table_of_model(model))
    key.write_text(text, encoding="utf-8")
    return Sealed(key=key, sha256=hashlib.sha256(key.read_bytes()).hexdigest())


def conceal(
    model: Model,
    folder: Path,
    rng: np.random.Generator,
    *,
    samples: int,
    seed: int,
    on_sample: Callable[[int], None] = lambda _: None,
) -> Concealed:
    """Makes the session in `folder`, and repeats it there with the model, and unwritten without its effect."""
    rig = firm_rig()
    plain = _session(rig, folder / "plain.mcap", samples=samples, seed=seed, on_sample=on_sample)
    reader, out = open_recording(plain), folder / "session.mcap"
    signals, planar = load_signals(reader), simulator("planar")
    without = planar.repeat(signals, PLAIN, rig=rig, rng=deepcopy(rng))
    simulated = planar.repeat(signals, model, rig=rig, rng=rng)
    write_simulated(reader, simulated, out, rig=rig, said={}, model_toml="")
    plain.unlink()
    return Concealed(recording=out, shows=not same(simulated, without))


def firm_rig() -> RigConfig:
    """Returns the simulated rig without what its file plants in it: the camera's mount does not sag."""
    table = load_table(assembly.simulated_rig_path())
    values = tomllib.loads(table.text)
    del values["planted"], values["camera"]["options"]["sag_px"]
    return rig_of_table(Table(values, table.file, tomli_w.dumps(values)))


def _session(rig: RigConfig, path: Path, *, samples: int, seed: int, on_sample: Callable[[int], None]) -> Path:
    plan = assembly.plan_from(None, samples=samples, seed=seed)
    origin = recordings.provenance(rig, plan, mode="lockstep", started_ns=SIMULATION_EPOCH_NS)
    with Recording(path, provenance=origin, flush_every_s=10.0) as recording:
        Lockstep(rig, plan, recording=recording).run(on_sample=on_sample)
    return path


@dataclass(frozen=True, kw_only=True)
class Revealed:
    """Says in sentences if the concealed effect was named first, or in a class that cannot be told apart."""

    right: bool
    lines: tuple[str, ...]


def reveal(concealed: Model, found: Diagnosis, known: Catalogue, *, shows: bool = True) -> Revealed:
    """Tells what was concealed, what was found, and how much better unseen runs are predicted.

    `shows` is False if the session is the same without the concealed effect.
    """
    (term,) = concealed.terms
    said = [one for one in found.effects if one.id in found.names]
    ranks = [rank for rank, one in enumerate(said) if term.effect.id in one.class_ids]
    near = bool(said) and said[0].id in confused(known, term.effect.id)
    lines = [
        f"Concealed: {term.effect.title}: {_planted(term)}",
        f"Found:     {'; '.join(_found(one, known) for one in said) or 'nothing that is sure enough to be named'}",
        *_improvement(found),
        _right(further=len(said) > 1, first=ranks[0] == 0)
        if ranks
        else _wrong(said, near, _unseen(found, term.effect.id, shows)),
    ]
    return Revealed(right=ranks[:1] == [0], lines=tuple(lines))


def _right(*, further: bool, first: bool) -> str:
    if not first:
        return "Wrong: the effect is named, but only after something that was not concealed."
    return "Right, with a further name." if further else "Right."


def _wrong(said: list[EffectFound], near: bool, unseen: str) -> str:
    could_not = f"this recording could not show the effect: {unseen}"
    if not said:
        return f"Not named, because {could_not}." if unseen else "Missed: the effect was not named."
    return f"Wrong{', by a name that is easily confused with it' if near else ''}{f'; {could_not}' if unseen else ''}."


def _unseen(found: Diagnosis, concealed: str, shows: bool) -> str:
    """Returns the reason why the recording could not show the concealed effect; empty if it could."""
    if not shows:
        return "the session is the same without it"
    return untestable_because(found) if found.verdict == "untestable" else found.untestable.get(concealed, "")


def _planted(term: Term) -> str:
    sizes = {one.name: Value(value=term.values[one.name], sd=np.nan, unit=one.unit) for one in term.effect.parameters}
    return _numbers({name: value for name, value in sizes.items() if value.value != 0.0})


def _found(effect: EffectFound, known: Catalogue) -> str:
    """Returns the name, or those that cannot be told apart, with its probability and its sizes."""
    titles = [known[name].title if name in known else OUTSIDE for name in effect.class_ids]
    title = " or ".join(titles) if len(titles) > 1 else effect.title
    numbers = _numbers(_sizes(effect, known))
    return f"{title}, probability {effect.probability:.2f}" + (f": {numbers}" if numbers else "")


def _sizes(effect: EffectFound, known: Catalogue) -> Mapping[str, Value]:
    """Returns the effect's sizes without its shapes: those that surely differ from nothing, or all if none does."""
    if effect.id not in known:
        return {}
    names = [one.name for one in known[effect.id].parameters if not one.is_shape]
    sizes = {name: effect.parameters[name] for name in names if name in effect.parameters}
    return {name: one for name, one in sizes.items() if abs(one.value) > SURE * one.sd} or sizes


def _numbers(values: Mapping[str, Value]) -> str:
    return ", ".join(f"{read_name(name, value.unit)} = {value}" for name, value in values.items())


def _improvement(found: Diagnosis) -> list[str]:
    before, after = found.fit.before.path_median_mm, found.fit.after.path_median_mm
    if not np.isfinite([before, after]).all():
        return []
    return [f"Held-out runs: {PATH_ERROR} {before:.2f} mm before, {after:.2f} mm after"]
