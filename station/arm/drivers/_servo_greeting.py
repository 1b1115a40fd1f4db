"""The options of a servo tilt stage, and what it says of itself when its line opens; see `servo`."""

from __future__ import annotations

import secrets
import time
from dataclasses import dataclass

from shared.byte_links import ByteLink
from shared.errors import UserError
from station.arm.drivers import _servo_lines as lines
from station.rig.arm_model import ArmModel

_LISTEN_S, _ASK_EVERY = 0.02, 12  # a board that starts hears nothing for a second or two


@dataclass(frozen=True, kw_only=True)
class ServoOptions:
    """The `[arm.options]` table for this driver; see `servo`."""

    port: str
    baud: int = 115200
    answer_timeout_s: float = 5.0
    level_by_hand: bool = False


def new_life() -> int:
    """Returns a name for the board's life, which is no other's: 1 to 2**30."""
    return 1 + secrets.randbelow(2**30)


def greeted(link: ByteLink, taken: lines.Lines, options: ServoOptions, *, life: int) -> lines.Hello:
    """Asks the stage what it is, until it answers; `taken` keeps what the line has brought besides.

    The board gets the name `life`, which it forgets when it starts anew.

    Raises:
        UserError: if nothing answers as a stage within `answer_timeout_s`.
    """
    for turn in range(max(1, round(options.answer_timeout_s / _LISTEN_S))):
        if turn % _ASK_EVERY == 0:
            link.write(lines.line("?", life))
        time.sleep(_LISTEN_S)
        for words in taken.take(link.read()):
            if (answer := lines.hello(words)) and answer.life in (life, 0):
                return answer
    raise UserError(
        f"Expected a tilt stage at {options.port}, but nothing there answers as one within "
        f"{options.answer_timeout_s:g} s: load the sketch of deploy/tilt_stage, and check 'port' and 'baud'"
    )


def require_fit(hello: lines.Hello, model: ArmModel, options: ServoOptions) -> None:
    """Refuses a stage that is not the model's.

    Raises:
        UserError: saying what differs, and what to do.
    """
    if hello.version != lines.VERSION or len(hello.limits) != len(model.joints):
        raise UserError(
            f"Expected a stage of {len(model.joints)} axes, as {model.name} has them, and version {lines.VERSION}; "
            f"got {len(hello.limits)} axes and version {hello.version}: correct 'model', or AXES in the sketch"
        )
    for joint, (lower, upper) in zip(model.joints, hello.limits, strict=True):
        own = (joint.lower_rad or 0.0, joint.upper_rad or 0.0)
        if own[0] < lower * lines.UNIT_RAD - 1e-6 or own[1] > upper * lines.UNIT_RAD + 1e-6:
            raise UserError(
                f"Expected limits of {joint.name} within the stage's own {lower / lines.PER_DEGREE:g} to "
                f"{upper / lines.PER_DEGREE:g} degrees; narrow them in the file of the model {model.name}"
            )
    if not hello.placed and not options.level_by_hand:
        raise UserError(
            f"The tilt stage at {options.port} has no angle sensors and does not know how it stands: put it level by "
            "hand before each start, and say so with level_by_hand = true in [arm.options]"
        )
