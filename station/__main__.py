"""The `station` command. Each subcommand is a file in station/app/commands, imported only when it is asked for."""

from __future__ import annotations

import argparse
import ast
import importlib
import os
import sys
from pathlib import Path
from types import ModuleType

from shared.errors import UserError

COMMANDS = Path(__file__).parent / "app" / "commands"
_ABOUT = """\
The laptop's side of Repose: a robot arm tilts a plate until a block slides, a camera watches the block, and the
station measures friction from it. Without hardware, `station rig` runs the whole rig simulated."""


def main(arguments: list[str] | None = None) -> int:
    """Runs a command; gives its exit status: 0 done, 1 done with findings or a fault, 2 a mistake in what was asked."""
    words = sys.argv[1:] if arguments is None else arguments
    parser = argparse.ArgumentParser(prog="station", description=_ABOUT, formatter_class=argparse.RawTextHelpFormatter)
    choices = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    files = {_constant(path, "NAME") or path.stem: path for path in sorted(COMMANDS.glob("[a-z]*.py"))}
    if " ".join(words[:2]) in files:  # two-word commands such as `station arm plan`
        words = [" ".join(words[:2]), *words[2:]]
    modules: dict[str, ModuleType] = {}
    for name, path in files.items():
        sub = choices.add_parser(
            name, help=_constant(path, "HELP"), formatter_class=argparse.ArgumentDefaultsHelpFormatter
        )
        if words and words[0] == name:
            modules[name] = importlib.import_module(f"station.app.commands.{path.stem}")
            sub.description = modules[name].__doc__
            modules[name].add_arguments(sub)
    options = parser.parse_args(words)
    try:
        return int(modules[options.command].run(options))
    except UserError as error:
        print(f"station {options.command}: {error}", file=sys.stderr)
        return 2
    except BrokenPipeError:
        # Whoever read our output (head, less) has had enough. Nothing more may be written, not even at the end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except KeyboardInterrupt:
        print("Stopped.", file=sys.stderr)
        return 130


def _constant(path: Path, name: str) -> str:
    """A text constant of a command's file, read without importing it, so that `station --help` is quick."""
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign) and any(isinstance(to, ast.Name) and to.id == name for to in node.targets):
            return str(ast.literal_eval(node.value))
    return ""


if __name__ == "__main__":
    sys.exit(main())
