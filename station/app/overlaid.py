"""A diagnosis as a Rerun file: the recording, its simulation before and after, and the located stretches marked."""

from __future__ import annotations

from pathlib import Path

from shared.errors import UserError
from shared.rig import RigConfig
from station.app.commands.replay import setup_for
from station.app.simulating import simulator_of
from station.diagnosis.report.html import p_equals
from station.diagnosis.report.sentences import next_lines, sentence
from station.diagnosis.result import Diagnosis
from station.pages.markdown import inline
from station.physics.catalogue import Catalogue
from station.physics.model import Model, model_of_table
from station.recording.arrays import load_signals
from station.recording.reader import RecordingReader
from station.signals.session import Signals
from station.simulators.recorded_runs import poses_of, recorded_runs
from station.simulators.simulator import AS_IT_IS, OwnFriction
from station.view import colours
from station.view.overlay import Ghost, Overlay, Stretch
from station.view.overlay import Path as BlockPath
from station.view.rrd import write_rrd


def write_overlay(
    reader: RecordingReader,
    diagnosis: Diagnosis,
    out: Path,
    *,
    rig: RigConfig,
    known: Catalogue,
    rig_path: Path | None,
    simulate: str = "planar",
) -> int:
    """Writes the file; gives the number of messages drawn.

    Args:
        reader: the recording that was diagnosed.
        diagnosis: what was found in it.
        out: the .rrd file to write.
        rig: sizes of block and plate, for the simulation.
        known: the effects that the model may name.
        rig_path: the rig file that the shapes are drawn from; None: the recording's own.
        simulate: name of a simulator, or a simulation of the user's, of which there is a before and no after.

    Raises:
        UserError: if nothing could be tested, if the recording cannot be simulated, or the file cannot be written.
    """
    if diagnosis.verdict == "untestable":
        raise UserError(f"Expected a recording that can be simulated for --overlay, got: {sentence(diagnosis)}")
    recorded = load_signals(reader)
    overlay = overlay_of(recorded, diagnosis, rig=rig, known=known, simulate=simulate)
    items = ((item.topic, item.message, item.publish_ns) for item in reader.messages())
    setup = setup_for(reader, rig_path=None if rig_path is None else str(rig_path))
    name = f"{reader.path.stem}: recorded and simulated"
    return write_rrd(items, out, topics=reader.topics, setup=setup, name=name, overlay=overlay).count


def overlay_of(
    recorded: Signals, diagnosis: Diagnosis, *, rig: RigConfig, known: Catalogue, simulate: str = "planar"
) -> Overlay:
    """Simulates the recorded commands with the plain model and with the one that was found; raises as above."""
    engine = simulator_of(simulate)
    own = isinstance(engine, OwnFriction)  # a simulation of the user's is drawn as it is
    before = engine.repeat(recorded, AS_IT_IS if own else Model(mu_s=diagnosis.mu_s.value), rig=rig)
    ghosts = [Ghost(name="before", path=_path(before), colour=colours.SIMULATED_BEFORE)]
    both = bool(diagnosis.names) and not own
    if both:
        after = engine.repeat(recorded, model_of_table(diagnosis.model, known), rig=rig)
        ghosts.append(Ghost(name="after", path=_path(after), colour=colours.SIMULATED_AFTER))
    return Overlay(
        recorded=_path(recorded),
        ghosts=tuple(ghosts),
        stretches=_stretches(diagnosis),
        runs=tuple((run.begin_ns, run.end_ns) for run in recorded_runs(recorded)),
        words=_words(diagnosis, simulate, both=both),
    )


def _path(signals: Signals) -> BlockPath:
    poses = poses_of(signals)
    return BlockPath(time_ns=poses.time_ns, pose=poses.pose)


def _stretches(diagnosis: Diagnosis) -> tuple[Stretch, ...]:
    return tuple(
        Stretch(run=one.run, from_ns=one.from_ns, to_ns=one.to_ns, phase=place.phase, why=place.summary)
        for place in diagnosis.located
        for one in place.windows
    )


def _words(diagnosis: Diagnosis, simulate: str, *, both: bool) -> str:
    lines = [f"## {inline(sentence(diagnosis))}", "", f"Global {p_equals(diagnosis.global_p)}", ""]
    lines += [f"- {inline(place.summary)} ({p_equals(place.p)})" for place in diagnosis.located]
    if diagnosis.next_experiment is not None:
        lines += ["", *map(inline, next_lines(diagnosis))]
    ghosts = f"grey wires: simulated before ({inline(simulate)})" + ("; green wires: simulated after" if both else "")
    return "\n".join([*lines, "", f"Solid block: recorded; {ghosts}; pink: where they differ."])
