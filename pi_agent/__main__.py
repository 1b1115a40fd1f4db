"""The command `pi-agent`: run the camera agent, track pictures, calibrate the camera."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence

from shared.arguments import Parser, ending
from shared.installed import version
from shared.programs import exit_status
from shared.system.processes import follow_parent
from shared.system.terminal import outlive_terminal, print_all_letters

DESCRIPTION = """\
The camera's side of a rig: finds the block's marker in every frame and sends its corners over the bus.

  pi-agent run --rig rig.toml        run the rig's camera
  pi-agent run --camera synthetic    draw what a camera sees of `station twin`
  pi-agent track PICTURE.png --json  what the tracker makes of a picture, video
  pi-agent calibrate --help          measure lens, plate, tone curve and noise
  pi-agent serve --rig rig.toml      a page for focus, exposure, calibration
"""
COMMANDS = {
    "run": ("pi_agent.run_command", "run the camera agent (the default, if there are options)"),
    "track": ("pi_agent.tracking.command", "run the tracker on pictures or a video"),
    "calibrate": ("pi_agent.calibration.command", "measure the camera and keep the result beside the rig file"),
    "serve": ("pi_agent.page.command", "a page in the browser for focus, exposure and calibration"),
}
"""The module of each command and what the list of commands says of it."""


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command line; returns its exit status (2: something that the user can mend)."""
    print_all_letters(sys.stdout, sys.stderr)
    if follow_parent() or sys.stdout.isatty():
        outlive_terminal()
    words = list(sys.argv[1:] if argv is None else argv)
    if words and words[0].startswith("-") and words[0] not in {"-h", "--help", "--version"}:
        words.insert(0, "run")
    return exit_status("pi-agent", lambda: _run(words))


def _run(words: list[str]) -> int:
    """Reads the words and does what they ask; only that command is imported, as tracking must start fast on a Pi."""
    epilog = ending(one="done, with findings or a fault that is said", example="pi-agent run --rig rig.toml")
    parser = Parser(prog="pi-agent", description=DESCRIPTION, epilog=epilog)
    parser.add_argument("--version", action="version", version=f"pi-agent {version()}")
    choices = parser.add_subparsers(dest="command", metavar=f"{{{','.join(COMMANDS)}}}")
    asked = parser
    for name, (module, help_text) in COMMANDS.items():
        sub = choices.add_parser(name, help=help_text)
        if words and name == words[0]:
            asked, command = sub, importlib.import_module(module)
            sub.description = command.__doc__
            sub.epilog = ending(
                one=getattr(command, "ONE", ""), stopped=getattr(command, "STOPPED", ""), example=command.EXAMPLE
            )
            command.add_arguments(sub)
            sub.set_defaults(action=command.run)
    options, unknown = parser.parse_known_args(words)
    if unknown:
        asked.refuse(unknown)
    if options.command is None:
        parser.print_help()
        return 0
    return options.action(options)


if __name__ == "__main__":
    sys.exit(main())
