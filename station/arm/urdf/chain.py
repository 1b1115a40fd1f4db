"""The joints from base to tip, and the bodies between them: links that hang together by fixed joints are one body."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from shared.errors import UserError
from station.arm.urdf.robot import Link, Robot, UrdfJoint
from station.rig.arm_model import Array

_MOST_JOINTS = 32


@dataclass(frozen=True, kw_only=True)
class Body:
    """Links that move as one, each with body_from_link (4, 4), in the frame of the joint that moves them."""

    links: tuple[tuple[Link, Array], ...]


@dataclass(frozen=True, kw_only=True)
class Chain:
    """An arm: the foot, then each moving joint with its frame in the frame before it (4, 4) and its body.

    `last_from_tip` (4, 4) is where the tip is on the last body; `left_out` are links that other joints move.
    """

    base: str
    tip: str
    foot: Body
    steps: tuple[tuple[UrdfJoint, Array, Body], ...]
    last_from_tip: Array
    left_out: tuple[str, ...]


def chain_of(robot: Robot, *, base: str | None = None, tip: str | None = None) -> Chain:
    """Gives the joints from `base` (the root by default) to `tip` (by default the link behind the most moving joints).

    Raises:
        UserError: if there is no such link, no way between them, several tips to choose from, or a joint on the way
            that this program cannot move.
    """
    base = _known(robot, base or robot.root)
    path = _path(robot, base, _known(robot, tip) if tip else _farthest(robot, base))
    tip = path[-1].child if path else base
    if not any(joint.moves for joint in path):
        raise UserError(f"Expected a joint that moves between {base!r} and {tip!r}, found none; name --base and --tip")
    for joint in path:
        _require_movable(joint)
    steps, before, frames = [], np.eye(4), _frames(robot, base, path)
    for joint in path:
        before = before @ joint.parent_from_child
        if joint.moves:
            steps.append((joint, before, _body(robot, joint.child, path)))
            before = np.eye(4)
    if len(steps) > _MOST_JOINTS:
        raise UserError(f"Expected at most {_MOST_JOINTS} moving joints from {base!r} to {tip!r}, found {len(steps)}")
    kept = {link.name for _, _, body in steps for link, _ in body.links} | frames
    left_out = tuple(sorted(set(_below(robot, base)) - kept - set(_below(robot, tip))))
    return Chain(
        base=base, tip=tip, foot=_body(robot, base, path), steps=tuple(steps), last_from_tip=before, left_out=left_out
    )


def _known(robot: Robot, link: str) -> str:
    if link not in robot.links:
        listed = ", ".join(list(robot.links)[:30])
        raise UserError(f"Expected a link of {robot.name} (--base, --tip), got {link!r}; it has {listed}")
    return link


def _farthest(robot: Robot, base: str) -> str:
    """Returns the link that ends the longest way from the base in moving joints.

    Of frames on one body, only the last counts.

    Raises:
        UserError: naming those that there are to choose from.
    """
    leaves = [link for link in _below(robot, base) if not _children(robot, link)]
    moving = {leaf: sum(joint.moves for joint in _path(robot, base, leaf)) for leaf in leaves}
    most = max(moving.values(), default=0)
    found = sorted(leaf for leaf, count in moving.items() if count == most)
    if len(found) != 1:
        listed = ", ".join(found[:10])
        raise UserError(f"Expected one end of the arm, where the plate is mounted, but it may be {listed}: name --tip")
    return found[0]


def _path(robot: Robot, base: str, tip: str) -> list[UrdfJoint]:
    joints: list[UrdfJoint] = []
    while tip != base:
        joint = robot.joints.get(tip)
        if joint is None or len(joints) > len(robot.joints):
            raise UserError(f"Expected a way from {base!r} down to the tip, but no joints lead there; name other links")
        joints.append(joint)
        tip = joint.parent
    return joints[::-1]


def _require_movable(joint: UrdfJoint) -> None:
    if joint.kind not in ("revolute", "continuous", "fixed"):
        raise UserError(
            f"Expected joints that turn, but {joint.name!r} is {joint.kind}; choose --base and --tip without it, or "
            "make it fixed where it stands still"
        )
    if joint.mimics:
        raise UserError(f"Expected joints that move by themselves, but {joint.name!r} mimics {joint.mimics!r}")


def _children(robot: Robot, link: str) -> list[UrdfJoint]:
    return [joint for joint in robot.joints.values() if joint.parent == link]


def _below(robot: Robot, link: str) -> Iterator[str]:
    """Yields the link and all that hang on it."""
    waiting, seen = [link], set[str]()
    while waiting:
        here = waiting.pop()
        if here not in seen:
            seen.add(here)
            yield here
            waiting.extend(joint.child for joint in _children(robot, here))


def _frames(robot: Robot, base: str, path: list[UrdfJoint]) -> set[str]:
    """Returns the names of the links of the foot, and of those on the way."""
    return {link.name for link, _ in _body(robot, base, path).links} | {joint.child for joint in path}


def _body(robot: Robot, first: str, path: list[UrdfJoint]) -> Body:
    """Returns a link with all that fixed joints hold to it, but nothing that is mounted on the tip."""
    tip = path[-1].child
    links: list[tuple[Link, Array]] = []
    waiting = [(first, np.eye(4))]
    while waiting:
        name, here = waiting.pop()
        links.append((robot.links[name], here))
        if name != tip:
            held = [joint for joint in _children(robot, name) if not joint.moves]
            waiting.extend((joint.child, here @ joint.parent_from_child) for joint in held)
    return Body(links=tuple(links))
