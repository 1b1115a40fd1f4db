"""The `station` command. Each subcommand is a file in station/app/commands, imported only when it is asked for."""

from __future__ import annotations

import argparse
import ast
import gc
import importlib
import logging
import re
import sys
from pathlib import Path
from types import ModuleType

from shared.installed import version
from shared.programs import exit_status
from shared.system.desktop import outlive_terminal, print_all_letters
from shared.system.processes import follow_parent

COMMANDS = Path(__file__).parent / "app" / "commands"
_ABOUT = """\
The laptop's side of Repose: a robot arm tilts a plate until a block slides, a camera watches the block, and the
station measures friction from it. Without hardware, `station rig` runs the whole rig simulated."""


def main(arguments: list[str] | None = None) -> int:
    """Runs a command; gives its exit status: 0 done, 1 done with findings or a fault, 2 a mistake in what was asked."""
    print_all_letters(sys.stdout, sys.stderr)
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # else it warns of a home in which it can keep no cache
    if follow_parent() or sys.stdout.isatty():
        outlive_terminal()
    words = sys.argv[1:] if arguments is None else arguments
    files = {_constant(path, "NAME") or path.stem: path for path in sorted(COMMANDS.glob("[a-z]*.py"))}
    if " ".join(words[:2]) in files:  # two-word commands such as `station arm plan`
        words = [" ".join(words[:2]), *words[2:]]
    return exit_status(" ".join(["station", *words[:1]]), lambda: _run(words, files))


def _run(words: list[str], files: dict[str, Path]) -> int | None:
    """Reads the words and does what they ask; importing a command is part of it, as it may lack a package."""
    parser = argparse.ArgumentParser(prog="station", description=_ABOUT, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--version", action="version", version=f"station {version()}")
    choices = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    modules: dict[str, ModuleType] = {}
    for name, path in files.items():
        sub = choices.add_parser(
            name, help=_constant(path, "HELP"), formatter_class=argparse.ArgumentDefaultsHelpFormatter
        )
        if words and words[0] == name:
            modules[name] = _imported(f"station.app.commands.{path.stem}")
            sub.description = modules[name].__doc__
            modules[name].add_arguments(sub)
    options = parser.parse_args(words)
    return modules[options.command].run(options)


def _imported(module: str) -> ModuleType:
    """Imports a command without searching for garbage meanwhile, and leaves what it loads, which stays, unsearched."""
    gc.disable()
    try:
        return importlib.import_module(module)
    finally:
        gc.freeze()
        gc.enable()


def _constant(path: Path, name: str) -> str:
    """A text constant of a command's file, `NAME = "text"` in one line, read without importing or parsing the file.

    Parsing them all would take longer than many a command.
    """
    found = re.search(rf"^{name} = (\".*\")$", path.read_text(encoding="utf-8"), re.MULTILINE)
    return str(ast.literal_eval(found[1])) if found else ""


if __name__ == "__main__":
    sys.exit(main())
