"""The programs of this environment: how to call them from a shell, and how they end."""

from __future__ import annotations

import os
import shutil
import sys
import traceback
from collections.abc import Callable
from pathlib import Path

from shared.errors import UserError
from shared.installed import missing_as_user_error
from shared.system.desktop import from_here
from shared.visible import sentence

OWN_FAULT = 70
"""The exit status after a fault of the program itself, EX_SOFTWARE of sysexits.h: no command ends with it by itself, so
a script can tell a traceback from findings, which are 1."""


def how_to_call(name: str) -> str:
    """Returns the program's name if it is on the path, else its path in this environment, from the present folder."""
    return name if shutil.which(name) else from_here(Path(sys.executable).parent / name)


def exit_status(name: str, action: Callable[[], int | None]) -> int:
    """Runs a program's action; gives its exit status: its own (None: 0), 2 after a user's mistake, said in words.

    A fault of the program itself is told with its traceback, and is OWN_FAULT. A package that an extra would bring is a
    mistake; any other that is missing is such a fault.

    Whoever read the output (head, less) may have had enough of it (0), and Ctrl-C ends it without a traceback (130).
    """
    try:
        with missing_as_user_error():
            return int(action() or 0)
    except UserError as error:
        print(f"{name}: {sentence(str(error))}", file=sys.stderr)
        return 2
    except BrokenPipeError:
        # Nothing more may be written, not even at the end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except KeyboardInterrupt:
        print("Stopped.", file=sys.stderr)
        return 130
    except Exception:
        traceback.print_exc()
        print(f"{name}: this is a fault of the program, not yours; what stands above tells where.", file=sys.stderr)
        return OWN_FAULT
