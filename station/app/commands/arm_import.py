"""Makes an arm's model (TOML) of a robot's URDF: joints, limits, collision capsules, a home pose.

Mass and capsule of each link come from the file and its meshes; what the file does not say is estimated, printed, and
written as comments into the model. Look through it before a real arm moves by it.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from shared.errors import UserError
from shared.installed import missing_as_user_error
from shared.programs import how_to_call
from station.app.outputs import require_writable, write_text
from station.arm.planning import Pose
from station.arm.urdf.chain import Chain, chain_of
from station.arm.urdf.home import with_home
from station.arm.urdf.model import draft
from station.arm.urdf.robot import read_robot
from station.arm.urdf.shapes import Meshes
from station.arm.urdf.written import toml_of
from station.rig.arm_model import ArmModel, Joint, load_arm_model

NAME = "arm import"
HELP = "make an arm's model of a robot's URDF"
EXAMPLE = "station arm import robot.urdf --out my_arm.toml"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument(
        "urdf",
        type=Path,
        help="the robot's URDF, which its maker publishes (of a xacro: `xacro robot.urdf.xacro > robot.urdf`)",
    )
    parser.add_argument("--base", help="link at the arm's foot; by default the one that hangs on no joint")
    parser.add_argument("--tip", help="link on which the plate is mounted, its normal along z; by default the last one")
    parser.add_argument("--name", help="the arm's name; by default the robot's")
    parser.add_argument("--out", type=Path, help="the model to write; by default NAME.toml")
    parser.add_argument(
        "--home-deg", help="joint angles that hold the plate level, as A,B,...; by default searched for"
    )
    parser.add_argument(
        "--package",
        action="append",
        default=[],
        metavar="NAME=FOLDER",
        help="where package://NAME/ is; may be repeated",
    )


@missing_as_user_error()
def run(options: argparse.Namespace) -> int:
    """Reads, estimates, looks for a home pose, writes, and says what it estimated."""
    robot = read_robot(options.urdf)
    name = options.name or robot.name
    out = options.out or Path(f"{_file_name(name)}.toml")
    if out.exists():
        raise UserError(f"Expected a new file for the model, but {out} is there; give another --out, or remove it")
    require_writable(out, what="model (--out FILE)")
    chain = chain_of(robot, base=options.base, tip=options.tip)
    meshes = Meshes(folder=options.urdf.parent, packages=dict(_package(text) for text in options.package))
    drafted = draft(chain, meshes, name=name, source=f"{options.urdf.name}, {chain.base} to {chain.tip}")
    homed = with_home(drafted.model, home_rad=_angles(options.home_deg))
    about = list(_about(chain, drafted.notes, homed.pose))
    write_text(out, toml_of(homed.model, notes=drafted.notes, about=about), what="model")
    load_arm_model(out)
    print(_table(homed.model))
    print("\n".join([*about, *_estimates(drafted.notes)]))
    print(f"\nModel: {out}\nPlan it:  {how_to_call('station')} arm plan --model {out}")
    return 0


def _file_name(name: str) -> str:
    return "".join(letter if letter.isalnum() or letter in "-_" else "_" for letter in name) or "arm"


def _package(text: str) -> tuple[str, Path]:
    name, equals, folder = text.partition("=")
    if not (name and equals and folder):
        raise UserError(f"Expected --package NAME=FOLDER, got {text!r}")
    return name, Path(folder)


def _angles(text: str | None) -> list[float]:
    try:
        found = [math.radians(float(word)) for word in text.split(",")] if text else []
    except ValueError:
        raise UserError(f"Expected angles in degrees as --home-deg A,B,..., got {text!r}") from None
    if not all(map(math.isfinite, found)):
        raise UserError(f"Expected finite angles as --home-deg A,B,..., got {text!r}")
    return found


def _about(chain: Chain, notes: Mapping[str, Sequence[str]], pose: Pose) -> Iterator[str]:
    """Yields sentences for the screen and the file's head."""
    yield f"Made by `station arm import`, from link {chain.base} to {chain.tip}; check it before an arm moves by it."
    yield f"The plate is taken to be mounted at {chain.tip}, its normal along z, and the base to stand upright."
    reaches = ", ".join(f"{math.degrees(reach.angle_rad):.1f}" for reach in pose.reaches)
    yield f"It tilts from its home pose to {reaches} degrees in the four directions."
    if chain.left_out:
        yield f"Left out, because other joints move them: {', '.join(chain.left_out)}."
    yield from notes[""]


def _estimates(notes: Mapping[str, Sequence[str]]) -> Iterator[str]:
    """Yields a line for each estimate, with the parts that it is of."""
    parts_of: dict[str, list[str]] = {}
    for part, note in ((part, note) for part, found in notes.items() if part for note in found):
        parts_of.setdefault(note, []).append(part)
    yield from (f"Estimated: {note} ({', '.join(parts)})" for note, parts in parts_of.items())


def _table(model: ArmModel) -> str:
    head = f"{'joint':24} {'from':>7} {'to':>7} {'speed':>8} {'torque':>8} {'mass':>8}  capsule"
    return "\n".join([head, *map(_row, model.joints)])


def _row(joint: Joint) -> str:
    low, high = (
        "endless" if limit is None else f"{math.degrees(limit):.0f}°" for limit in (joint.lower_rad, joint.upper_rad)
    )
    capsule = joint.link_capsule
    long_mm, thick_mm = 1000 * math.dist(capsule.from_m, capsule.to_m), 2000 * capsule.radius_m
    return (
        f"{joint.name:24} {low:>7} {high:>7} {math.degrees(joint.max_velocity_rad_s):6.0f}/s "
        f"{joint.max_effort_nm:5.0f} Nm {joint.link_mass_kg:5.2f} kg  {thick_mm:.0f} mm thick round {long_mm:.0f} mm"
    )
