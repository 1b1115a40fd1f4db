"""The command `pi-agent`: run the camera agent, track pictures, calibrate the camera."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pi_agent import run_command
from shared.arguments import Parser
from shared.installed import version
from shared.programs import exit_status
from shared.system.desktop import outlive_terminal, print_all_letters
from shared.system.processes import follow_parent

DESCRIPTION = """\
The camera's side of a rig: finds the block's marker in every frame and sends its corners over the bus.

  pi-agent run --rig rig.toml              run the rig's camera (also without the word `run`)
  pi-agent run --camera synthetic          draw what the camera would see of `station twin`
  pi-agent track PICTURE.png --json        see what the tracker makes of pictures or a video
  pi-agent calibrate --help                measure the camera: lens, plate, tone curve, noise
  pi-agent serve --rig rig.toml            a page in the browser for focus, exposure and calibration
"""
COMMANDS = ("run", "track", "calibrate", "serve")


def _parser(command: str) -> Parser:
    """The parser; only the command in question reads its module, because tracking must start fast on a Pi."""
    parser = Parser(prog="pi-agent", description=DESCRIPTION)
    parser.add_argument("--version", action="version", version=f"pi-agent {version()}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="{run,track,calibrate,serve}")
    run = commands.add_parser("run", help="run the camera agent (the default)", description=run_command.__doc__)
    run_command.add_arguments(run)
    track = commands.add_parser("track", help="run the tracker on pictures or a video")
    calibrate = commands.add_parser("calibrate", help="measure the camera and keep the result beside the rig file")
    serve = commands.add_parser("serve", help="a page in the browser for focus, exposure and calibration")
    if command == "track":
        from pi_agent.tracking import command as track_command  # noqa: PLC0415  # see above

        track_command.add_arguments(track)
        track.set_defaults(action=track_command.run)
    if command == "calibrate":
        from pi_agent.calibration import command as calibrate_command  # noqa: PLC0415  # see above

        calibrate_command.add_arguments(calibrate)
        calibrate.set_defaults(action=calibrate_command.run)
    if command == "serve":
        from pi_agent.page import command as page_command  # noqa: PLC0415  # see above

        page_command.add_arguments(serve)
        serve.set_defaults(action=page_command.run)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command line; returns its exit status (2: something that the user can mend)."""
    print_all_letters(sys.stdout, sys.stderr)
    if follow_parent() or sys.stdout.isatty():
        outlive_terminal()
    arguments = list(sys.argv[1:] if argv is None else argv)
    about = {"-h", "--help", "--version"}
    if not arguments or (arguments[0] not in COMMANDS and arguments[0] not in about):
        arguments.insert(0, "run")
    options = _parser(arguments[0]).parse_args(arguments)
    return exit_status("pi-agent", lambda: options.action(options))


if __name__ == "__main__":
    sys.exit(main())
