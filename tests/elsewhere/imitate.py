"""Runs commands in an interpreter from which everything is taken that another system lacks.

    python -X warn_default_encoding -m tests.elsewhere.imitate windows OUT.json

reads command lines of `station` (or `pytest`) as JSON from standard input, runs them one after another and writes to
OUT.json what each gave and printed. Other people's packages are those of this system and are loaded first; what this
program loads afterwards sees the other one. It cannot show that those packages work elsewhere; the workflows can.
"""

from __future__ import annotations

import contextlib
import errno
import importlib
import io
import json
import os
import re
import signal
import subprocess
import sys
import time
import traceback
import types
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

PLATFORMS = {"linux arm64": "linux", "macos": "darwin", "windows": "win32"}
OTHERS = (
    "joblib",
    "matplotlib.pyplot",
    "mcap",
    "mujoco",
    "numba",
    "pyarrow",
    "rerun",
    "rich.progress",
    "zenoh",
    "scipy.optimize",
)
"""Packages that choose by the system what they load."""
ABSENT_ON_WINDOWS = ("fcntl", "grp", "pwd", "resource", "termios")
FORBIDDEN = re.compile(r'[<>:"|?*]')


def imitate(system: str) -> None:
    """Turns this interpreter into one of that system, as far as this program can see it."""
    for name in (*OTHERS, "pytest", "_pytest.capture"):
        importlib.import_module(name)
    {"linux arm64": _arm64, "macos": _macos, "windows": _windows}[system]()
    before, sys.platform = sys.platform, PLATFORMS[system]
    for name in ("desktop", "files", "processes"):
        importlib.import_module(f"shared.system.{name}")
    sys.platform = before
    warnings.filterwarnings("error", category=EncodingWarning, module=r"(station|shared|pi_agent)\b")


def _arm64() -> None:
    for name in ("ruckig", "ssik"):
        sys.modules[name] = None  # type: ignore[assignment]  # pyright: ignore[reportArgumentType]


def _macos() -> None:
    for name in ("posix_fallocate", "sched_getaffinity"):
        delattr(os, name)


def _windows() -> None:
    _macos()
    locking = types.ModuleType("msvcrt")
    _plant(locking, LK_NBLCK=2, LK_UNLCK=0, locking=_locking())
    sys.modules["msvcrt"] = locking
    for name in ABSENT_ON_WINDOWS:
        sys.modules[name] = None  # type: ignore[assignment]  # pyright: ignore[reportArgumentType]
    del os.fork
    for name in ("SIGKILL", "SIGUSR1", "SIGUSR2", "SIGHUP"):
        delattr(signal, name)
    spare = signal.SIGTTIN  # its number is that of Windows' SIGBREAK
    _plant(signal, SIGBREAK=spare, CTRL_BREAK_EVENT=spare)
    _plant(subprocess, CREATE_NEW_PROCESS_GROUP=0)
    for name, targets in (("replace", 2), ("rename", 2), ("unlink", 1), ("remove", 1)):
        setattr(os, name, _refusing_open_files(getattr(os, name), targets, new_name=name == "rename"))
    _plant(time, monotonic_ns=_in_steps(time.monotonic_ns), monotonic=lambda: time.monotonic_ns() * 1e-9)
    sys.addaudithook(_refuse_names)


def _plant(module: types.ModuleType, **names: Any) -> None:
    for name, value in names.items():
        setattr(module, name, value)


def _in_steps(clock: Callable[[], int]) -> Callable[[], int]:
    """GetTickCount64, which Python before 3.13 reads."""
    return lambda: clock() // 15_625_000 * 15_625_000


def _locking() -> Callable[[int, int, int], None]:
    """`msvcrt.locking`: a lock of bytes from the file's position on, which belongs to the open file."""
    import fcntl  # noqa: PLC0415 - it is gone afterwards
    import struct  # noqa: PLC0415

    def locking(descriptor: int, mode: int, count: int) -> None:
        position = os.lseek(descriptor, 0, os.SEEK_CUR)
        kind = fcntl.F_UNLCK if mode == 0 else fcntl.F_WRLCK if _writable(descriptor) else fcntl.F_RDLCK
        flock = struct.pack("hhqqi4x", kind, os.SEEK_SET, position, count, 0)
        fcntl.fcntl(descriptor, fcntl.F_OFD_SETLK, flock)

    def _writable(descriptor: int) -> bool:
        return bool(fcntl.fcntl(descriptor, fcntl.F_GETFL) & (os.O_WRONLY | os.O_RDWR))

    return locking


def _refusing_open_files(original: Callable[..., None], count: int, *, new_name: bool) -> Callable[..., None]:
    def refuse(*paths: Any, **more: Any) -> None:
        for path in paths[:count]:
            if os.path.realpath(path) in _open_files():
                raise PermissionError(errno.EACCES, "The process cannot access the file because it is used", str(path))
        if new_name and os.path.exists(paths[1]):
            raise FileExistsError(errno.EEXIST, "Cannot create a file when that file already exists", str(paths[1]))
        original(*paths, **more)

    return refuse


def _open_files() -> set[str]:
    found: set[str] = set()
    for descriptor in os.listdir("/proc/self/fd"):
        with contextlib.suppress(OSError):
            found.add(os.readlink(f"/proc/self/fd/{descriptor}"))
    return found


def _refuse_names(event: str, arguments: tuple[Any, ...]) -> None:
    if event == "open" and isinstance(arguments[0], str) and FORBIDDEN.search(Path(arguments[0]).name):
        raise OSError(errno.EINVAL, "Invalid argument", arguments[0])


def run(words: list[str]) -> dict[str, Any]:
    """Runs one command line; gives its exit status and all that it printed, as a pipe of that system would have it."""
    pipe = io.BytesIO()
    out = io.TextIOWrapper(pipe, encoding="cp1252", write_through=True)
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
        try:
            status = _program(words[0])(words[1:])
        except SystemExit as ended:
            status = ended.code
        except BaseException:
            status, _ = "traceback", out.write(traceback.format_exc())
    letters = out.encoding if words[0] == "pytest" else "utf-8"  # another system's pytest promises nothing
    return {"words": words, "status": status, "said": pipe.getvalue().decode(letters)}


def _program(name: str) -> Callable[[list[str]], Any]:
    if name == "pytest":
        return sys.modules["pytest"].main
    return importlib.import_module({"station": "station.__main__", "pi-agent": "pi_agent.__main__"}[name]).main


if __name__ == "__main__":
    imitate(sys.argv[1])
    Path(sys.argv[2]).write_text(json.dumps([run(words) for words in json.load(sys.stdin)]), encoding="utf-8")
