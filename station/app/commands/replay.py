"""Shows a recording in Rerun, laid out; with --live a session that is running; with --bus plays one onto the bus.

The view is written as an .rrd file with its layout inside and opened when there is a display. A picture needs only what
is near its moment: it takes seconds, and no view is written for it alone.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path

from rich.console import Console

from shared.bus_rights import OBSERVER
from shared.clock import SystemClock
from shared.config import parse
from shared.errors import UserError
from shared.messages import BlockPose, Message, TiltCommand
from shared.programs import how_to_call
from shared.rig import RigConfig, load_rig
from shared.system import desktop
from shared.system.signals import until_stopped
from shared.zenoh_bus import ZenohBus
from station.app import assembly
from station.app.attached import attached_rig, attached_table
from station.app.bars import counting
from station.app.moving import write_moving
from station.app.pictured import write_picture
from station.app.processes import paced
from station.recording.reader import RecordingReader, open_recording
from station.sampling.plan import Plan
from station.view import playback, viewer
from station.view.live import PORT, USUAL_TOPICS, LiveView
from station.view.rrd import write_rrd
from station.view.setup import Setup, Threshold, setup_from_poses, setup_of

NAME = "replay"
HELP = "show a recording (or a running session) in Rerun, or play it back onto the bus"
EXAMPLE = "station replay sim.mcap"
STOPPED = "0 with --live or --bus once it is on the bus"
_POSES = 50_000
_CONNECT_S = 1.0
_GONE_NS = 10_000_000_000
"""A station that is away for longer has ended. A link that was silent for a second is lost, and made again at once or
within seconds (`make faults ARGS="--row 'cable cut'"`): the view goes on then."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("file", type=Path, nargs="?", help="a recording (.mcap); none with --live")
    parser.add_argument("--rig", help="rig file; for showing, the one in the recording is the default")
    show = parser.add_argument_group("showing")
    show.add_argument("--save", type=Path, metavar="FILE.rrd", help="where the view is written; beside the recording")
    show.add_argument(
        "--screenshot",
        type=Path,
        metavar="OUT.png",
        help="draw a picture, display or not; without a display that is all",
    )
    show.add_argument(
        "--moving",
        type=Path,
        metavar="OUT.webp",
        help="draw the last degrees of a tilt and its slide as a moving picture (.webp or .gif), display or not",
    )
    show.add_argument("--at", type=float, metavar="S", help="the picture's moment, in seconds; after the last slip")
    show.add_argument("--no-viewer", action="store_true", help="do not open the viewer")
    show.add_argument("--live", action="store_true", help="show the session that runs on the rig's bus")
    show.add_argument("--port", type=int, default=PORT, help="with --live: where viewers connect, on 127.0.0.1")
    play = parser.add_argument_group("playing back")
    play.add_argument("--bus", action="store_true", help="publish the recording on the rig's bus instead")
    play.add_argument("--speed", type=float, default=1.0, help="with --bus: times faster than life")
    stand_ins = ",".join(playback.STAND_INS)
    play.add_argument("--as", dest="stand_ins", default=stand_ins, help="with --bus: the processes to stand in for")


def run(args: argparse.Namespace) -> int:
    """Does what was asked for."""
    if args.live:
        return _live(args)
    if args.file is None:
        raise UserError("Expected a recording (FILE.mcap), or --live to watch the session that is running")
    reader = open_recording(args.file)
    return _play(reader, args) if args.bus else _show(reader, args)


# --- showing ---------------------------------------------------------------------------------------------------------


def _show(reader: RecordingReader, args: argparse.Namespace) -> int:
    setup = setup_for(reader, rig_path=args.rig)
    if args.screenshot is not None:
        for complaint in write_picture(reader, args.screenshot, setup=setup, at_s=args.at):
            print(f"the viewer complains: {complaint}")
        print(f"Picture: {args.screenshot}")
    if args.moving is not None:
        count = write_moving(reader, args.moving, setup=setup, at_s=args.at)
        print(f"Moving picture: {args.moving}, {count} pictures, {args.moving.stat().st_size / 1e6:.1f} MB")
    looked_at = desktop.has_display() and not args.no_viewer
    if (args.screenshot is None and args.moving is None) or args.save is not None or looked_at:
        _write_view(reader, args, setup)
    return 0


def _write_view(reader: RecordingReader, args: argparse.Namespace, setup: Setup) -> None:
    """Draws the whole session, and opens it where there is a display."""
    target: Path = args.save or args.file.with_suffix(".rrd")
    print(f"Drawing {args.file} into {target}", flush=True)
    console = Console(stderr=True, highlight=False)
    with counting(console, "drawing", total=reader.measured_count, what="messages drawn") as done:
        drawn = write_rrd(_told(reader, done), target, topics=reader.topics, setup=setup, name=args.file.stem)
    print(f"{drawn.count} messages of {args.file} drawn into {target}")
    for topic, count in sorted(drawn.refused.items()):
        print(f"{count} messages of {topic} were left out: their numbers make no sense")
    if args.no_viewer:
        return
    if desktop.has_display():
        viewer.open_file(target)
    elif args.screenshot is None:
        look = f"{how_to_call('rerun')} {target}"
        print(f"There is no display here. Look with: {look}\nor draw a picture with: --screenshot OUT.png")


def _told(reader: RecordingReader, done: Callable[[int], None]) -> Iterator[tuple[str, Message, int]]:
    """Yields all messages as the view takes them, and tells how many it has drawn."""
    for number, item in enumerate(reader.messages(), 1):
        yield item.topic, item.message, item.publish_ns
        done(number)


def setup_for(reader: RecordingReader, *, rig_path: str | None) -> Setup:
    """Returns shapes and threshold.

    They come from a rig file, else from the recording's own, else from a guess by the block's places.
    """
    threshold = _threshold(reader)
    if rig_path is not None:
        return setup_of(load_rig(Path(rig_path)), threshold=threshold)
    rig = _own_rig(reader)
    if rig is None:
        found = (item.message for item in reader.messages({"block/pose"}))
        seen = (pose for pose in found if isinstance(pose, BlockPose) and pose.found)
        return setup_from_poses([(pose.x, pose.y, pose.z) for pose in islice(seen, _POSES)])
    return setup_of(rig, threshold=threshold, armed="arm/joints" in reader.topics)


def _own_rig(reader: RecordingReader) -> RigConfig | None:
    """Gives the recording's rig; one that this version cannot read is as good as none, since a view can do without."""
    try:
        return attached_rig(reader)
    except UserError:
        return None


def _threshold(reader: RecordingReader) -> Threshold:
    try:
        table = attached_table(reader, "plan.toml")
        slip = parse(Plan, table).slip if table else None
    except UserError:
        slip = None
    return Threshold(base_px=slip.base_px, per_deg_px=slip.per_deg_px) if slip else Threshold()


# --- live ------------------------------------------------------------------------------------------------------------


def _live(args: argparse.Namespace) -> int:
    rig = assembly.rig_from(args.rig)
    clock = SystemClock()
    with (
        until_stopped() as stopped,
        ZenohBus.of(OBSERVER, rig, clock=clock) as bus,
        LiveView(setup=setup_of(rig), port=args.port, expected=USUAL_TOPICS) as live,
    ):
        live.attach(bus)
        if args.no_viewer or not live.open_viewer():
            print(live.how_to_look, flush=True)
        heard_ns = 0
        for _ in paced(clock, bus, rate_hz=20.0, stopped=stopped):
            if "station" in bus.alive():
                heard_ns = clock.now_ns()
            elif heard_ns and clock.now_ns() - heard_ns > _GONE_NS:
                break
    if live.dropped:
        print(f"{sum(live.dropped.values())} messages were not drawn: the view could not keep up")
    return 0


# --- playing back ----------------------------------------------------------------------------------------------------


def _play(reader: RecordingReader, args: argparse.Namespace) -> int:
    rig = assembly.rig_from(args.rig)
    stand_ins = _stand_ins(args.stand_ins)
    names = playback.topics_of(reader.topics, stand_ins=stand_ins)
    if not names:
        raise UserError(f"Expected messages of {', '.join(stand_ins)} in {reader.path}, but it holds none")
    at = playback.endpoints_of(rig.bus, stand_ins=stand_ins)
    clock = SystemClock()
    with (
        until_stopped() as stopped,
        ZenohBus(rig.id, listen=at.listen, connect=at.connect, clock=clock, process=stand_ins[0]) as bus,
    ):
        player = playback.Playback(bus, clock=clock, stand_ins=stand_ins, commands=_commands(reader))
        bus.poll(_CONNECT_S)  # whoever listens is then connected before the first message
        print(f"Playing {reader.path} ({reader.duration_s:.1f} s) on the bus of rig '{rig.id}'", flush=True)
        items = (item for item in reader.messages(names) if not stopped.is_set())
        count = player.play(items, speed=args.speed)
    print(f"{count} messages of {len(names)} topics played" + (f"; {player.stopped}" if player.stopped else ""))
    return 0


def _stand_ins(text: str) -> tuple[str, ...]:
    names = tuple(name.strip() for name in text.split(",") if name.strip())
    if not names or not set(names) <= set(playback.STAND_INS):
        raise UserError(f"Expected some of {', '.join(playback.STAND_INS)} after --as, got '{text}'")
    return names


def _commands(reader: RecordingReader) -> set[tuple[int, int]]:
    found = (item.message for item in reader.messages({"arm/command"}))
    return {(command.run, command.step) for command in found if isinstance(command, TiltCommand)}
