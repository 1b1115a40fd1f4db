"""The `station` command. Each subcommand is a file in station/app/commands, imported only when it is asked for."""

from __future__ import annotations

import ast
import gc
import importlib
import logging
import os
import re
import sys
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType

from shared.arguments import Parser, ending
from shared.installed import version
from shared.programs import exit_status
from shared.system.processes import follow_parent
from shared.system.terminal import outlive_terminal, print_all_letters

COMMANDS = Path(__file__).parent / "app" / "commands"
_ABOUT = """\
The laptop's side of Repose: a robot arm tilts a plate until a block slides, a camera watches the block, and the
station measures friction from it. Without hardware, `station rig` runs the whole rig simulated, and `station demo`
shows how a concealed effect is found."""
_STATUS = """\
Exit status: 0: done; 1: done, with findings or a fault that is said; 2: a mistake in what was asked; 70: a fault of the
program, with a traceback; 130: stopped by Ctrl-C, where the command has nothing to bring to its end. `station COMMAND
--help` explains a command, says what Ctrl-C gives there, and ends with an example."""


def main(arguments: list[str] | None = None) -> int:
    """Runs a command; gives its exit status: 0 done, 1 done with findings or a fault, 2 a mistake in what was asked."""
    # Every command's matrices are small: for them numpy would keep a second thread spinning. `station plan --separate
    # contact_aging,wear` took 10.7 s of processor time with it and 5.7 s without, and as long on two cores.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    print_all_letters(sys.stdout, sys.stderr)
    logging.getLogger("matplotlib").setLevel(
        logging.ERROR
    )  # otherwise it warns of a home in which it can keep no cache
    if follow_parent() or sys.stdout.isatty():
        outlive_terminal()
    words = sys.argv[1:] if arguments is None else arguments
    files = commands()
    if " ".join(words[:2]) in files or _is_first_of_two(words[:2], files):  # commands such as `station arm plan`
        words = [" ".join(words[:2]), *words[2:]]
    asked = _group_help if _asks_for_group(words, files) else _run
    return exit_status(" ".join(["station", *words[:1]]), lambda: asked(words, files))


def _run(words: list[str], files: dict[str, Path]) -> int | None:
    """Reads the words and does what they ask; importing a command is part of it, as it may lack a package."""
    parser = Parser(prog="station", description=_ABOUT, epilog=_STATUS)
    parser.add_argument("--version", action="version", version=f"station {version()}")
    choices = parser.add_subparsers(dest="command", metavar="COMMAND")
    modules: dict[str, ModuleType] = {}
    asked = parser
    for name, path in files.items():
        sub = choices.add_parser(name, help=help_of(path))
        if words and words[0] == name:
            asked, modules[name] = sub, _imported(f"station.app.commands.{path.stem}")
            sub.description = f"{modules[name].__doc__}{_longer(name, files)}"
            sub.epilog = ending(**{said: _constant(path, said.upper()) for said in ("one", "stopped", "example")})
            modules[name].add_arguments(sub)
    options, unknown = parser.parse_known_args(words)
    if unknown:
        asked.refuse(unknown)
    if options.command is None:
        parser.print_help()
        return 0
    return modules[options.command].run(options)


def _longer(name: str, files: dict[str, Path]) -> str:
    """Returns the commands of two words that begin with a command's name, for the end of its description."""
    longer = [f"  station {other:<12} {help_of(path)}" for other, path in files.items() if other.startswith(f"{name} ")]
    return "\n".join(["\n\nCommands of its own:", *longer]) if longer else ""


def _is_first_of_two(words: list[str], files: Iterable[str]) -> bool:
    """Returns true if commands of two words begin with the first, and the second is no option of the first alone."""
    second = words[1] if len(words) > 1 else "-"
    return not second.startswith("-") and any(name.startswith(f"{words[0]} ") for name in files)


def _asks_for_group(words: list[str], files: Iterable[str]) -> bool:
    """Returns true if commands of two words begin with the words, which are no command themselves, as `keys` is."""
    first, *rest = words or [""]
    begins = first not in files and any(name.startswith(f"{first} ") for name in files)
    return begins and set(rest) <= {"-h", "--help"}


def _group_help(words: list[str], files: dict[str, Path]) -> None:
    """Prints the commands of two words that begin with the first word."""
    parser = Parser(prog=f"station {words[0]}", epilog=_STATUS.replace("COMMAND", f"{words[0]} COMMAND"))
    choices = parser.add_subparsers(metavar="COMMAND", required=True)
    for name, path in files.items():
        first, _, second = name.partition(" ")
        if first == words[0]:
            choices.add_parser(second, help=help_of(path))
    parser.print_help()


def examples() -> list[str]:
    """Returns the example in each command's help."""
    return [_constant(path, "EXAMPLE") for path in commands().values()]


def help_of(path: Path) -> str:
    """Returns the words of a command's file for the list of commands."""
    return _constant(path, "HELP")


def commands() -> dict[str, Path]:
    """Returns the file of each command by the command's name."""
    return {_constant(path, "NAME"): path for path in sorted(COMMANDS.glob("[a-z]*.py"))}


def _imported(module: str) -> ModuleType:
    """Imports a command without searching for garbage meanwhile, and leaves what it loads, which stays, unsearched.

    A command that is loaded already leaves nothing new: freezing again would keep the garbage of the time between.
    """
    if module in sys.modules:
        return sys.modules[module]
    gc.disable()
    try:
        return importlib.import_module(module)
    finally:
        gc.freeze()
        gc.enable()


def _constant(path: Path, name: str) -> str:
    """Returns a text constant of a command's file, `NAME = "text"` in one line; the file is not imported or parsed.

    Parsing them all would take longer than many a command.
    """
    found = re.search(rf"^{name} = (\".*\")$", path.read_text(encoding="utf-8"), re.MULTILINE)
    return str(ast.literal_eval(found[1])) if found else ""


if __name__ == "__main__":
    sys.exit(main())
