"""One input read under limits of time and memory: answered, refused in words, or a finding."""

from __future__ import annotations

import resource
import signal
import traceback
from collections.abc import Generator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from random import Random
from types import FrameType

from shared.errors import UserError
from shared.visible import sentence
from tests.fuzz.target import Target, Unclear, refuse_unclear

LIMIT_S = 20.0
"""The processor time for one input may be this long: the largest seeds take some tenths of a second."""
LIMIT_BYTES = 1 << 30


@dataclass(frozen=True)
class Outcome:
    """The reading of one input. `finding` is empty for an answer and for a refusal in words."""

    target: str
    number: int
    refused: bool
    seconds: float
    finding: str = ""


class Hang(BaseException):
    """An input took longer than `LIMIT_S`. No reader can catch it by mistake."""


def try_input(target: Target, number: int, *, seed: int, folder: Path) -> Outcome:
    """Makes the input of that number and reads it; the same seed and number give the same input."""
    path = folder / f"input{target.suffix}"
    path.write_bytes(target.make(Random(f"{seed} {number}")))
    before_s, refused, finding = _cpu_s(), False, ""
    try:
        with redirect_stdout(StringIO()), redirect_stderr(StringIO()), _limited():
            target.read(path)
    except UserError as error:
        refused, finding = True, _unclear(sentence(str(error)))
    except Hang:
        finding = f"hang: more than {LIMIT_S:g} s of processor time\n{traceback.format_exc(limit=-6)}"
    except Unclear as error:
        finding = str(error)
    except BaseException:
        finding = traceback.format_exc(limit=-8)
    if peak_bytes() > LIMIT_BYTES and not finding:
        finding = f"memory: {peak_bytes() / 1e9:.2f} GB"
    return Outcome(target.name, number, refused, _cpu_s() - before_s, finding)


def _unclear(said: str) -> str:
    try:
        refuse_unclear(said)
    except Unclear as error:
        return str(error)
    return ""


@contextmanager
def _limited() -> Generator[None]:
    def over(_number: int, _frame: FrameType | None) -> None:
        raise Hang

    signal.signal(signal.SIGPROF, over)
    signal.setitimer(signal.ITIMER_PROF, LIMIT_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def _cpu_s() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def peak_bytes() -> int:
    """The most memory that this process has ever had.

    Linux starts `ru_maxrss` of a new process at that of the process which started it: of a large one every input would
    be a finding. VmHWM is the program's own.
    """
    try:
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return next(1024 * int(line.split()[1]) for line in lines if line.startswith("VmHWM:"))
