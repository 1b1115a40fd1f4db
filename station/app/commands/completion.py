"""Prints what lets a shell complete the commands of `station` and `pi-agent` and their options with the Tab key.

bash: eval "$(station completion bash)" in ~/.bashrc. zsh: the same with zsh in ~/.zshrc, after compinit. fish: station
completion fish > ~/.config/fish/completions/station.fish. Printing takes some seconds, as it asks every command: for a
shell that starts at once, write it to a file, and have the shell read that.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass

from shared.arguments import Parser

NAME = "completion"
HELP = "print the completion of commands and options for bash, zsh or fish"
EXAMPLE = "station completion bash"


@dataclass(frozen=True, kw_only=True)
class Command:
    """A command with its options (name and help) and the words that may stand in it without an option."""

    name: str
    help: str
    options: tuple[tuple[str, str], ...]
    words: tuple[str, ...]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("shell", choices=sorted(_SHELLS), help="whose completion to print")


def run(options: argparse.Namespace) -> int:
    """Prints it; 0."""
    shell = _SHELLS[options.shell]
    print("\n".join([shell("station", list(_commands())), shell("pi-agent", list(_agent_commands()))]))
    return 0


def _commands() -> Iterator[Command]:
    """Yields all commands with what their own parsers take.

    One whose package is missing is completed without options.
    """
    from station.__main__ import commands, help_of  # noqa: PLC0415  # that module imports this one's kind

    for name, path in commands().items():
        parser = Parser(prog=f"station {name}")
        with contextlib.suppress(ModuleNotFoundError):
            importlib.import_module(f"station.app.commands.{path.stem}").add_arguments(parser)
        actions = parser.actions
        long = [(each, one.help or "") for one in actions for each in one.option_strings if each.startswith("--")]
        words = [str(word) for one in actions if not one.option_strings for word in one.choices or ()]
        yield Command(name=name, help=help_of(path), options=tuple(long), words=tuple(words))


def _agent_commands() -> Iterator[Command]:
    """Yields the commands of the camera agent, which is another program: its help tells them."""
    for name, help_text in re.findall(r"^    (\w+) +(\S.*)$", _agent_help(), re.MULTILINE):
        found = re.findall(r"^  (?:-\w, )?(--[\w-]+)(?: .*?(?:  +(\S.*))?)?$", _agent_help(name), re.MULTILINE)
        long = tuple((each, " ".join(said.split())) for each, said in found)
        yield Command(name=name, help=" ".join(help_text.split()), options=long, words=())


def _agent_help(*words: str) -> str:
    """Returns the help of `pi-agent`, or of a command of it, with each explanation in the line of what it explains."""
    asked = [sys.executable, "-m", "pi_agent", *words, "--help"]
    printed = subprocess.run(asked, capture_output=True, text=True, check=False).stdout
    return re.sub(r"(?<=\S)\n {8,}", "  ", printed)


def _bash(program: str, commands: list[Command]) -> str:
    """Gives a function that knows the words of each command; where it has none to offer, bash completes file names."""
    function = f"_{program.replace('-', '_')}"
    first = sorted({one.name.split()[0] for one in commands})
    second = {name: [one.name.split()[1] for one in commands if one.name.startswith(f"{name} ")] for name in first}
    cases = [f"    {shlex.quote(one.name)}) words={shlex.quote(' '.join(_offered(one)))} ;;" for one in commands]
    follow = [f"    {name}) words+={shlex.quote(' ' + ' '.join(rest))} ;;" for name, rest in second.items() if rest]
    pairs = "|".join(shlex.quote(one.name) for one in commands if " " in one.name) or "''"
    return "\n".join(
        [
            f"{function}() {{",
            '  local word="${COMP_WORDS[COMP_CWORD]}" name="${COMP_WORDS[1]}" words=""',
            f'  if [ "$COMP_CWORD" -eq 1 ]; then COMPREPLY=($(compgen -W {shlex.quote(" ".join(first))} -- "$word")); '
            "return; fi",
            f'  if [ "$COMP_CWORD" -gt 2 ]; then case "$name ${{COMP_WORDS[2]}}" in {pairs}) '
            'name="$name ${COMP_WORDS[2]}" ;; esac; fi',
            '  case "$name" in',
            *cases,
            "  esac",
            '  if [ "$COMP_CWORD" -eq 2 ]; then case "$name" in',
            *follow,
            "  esac; fi",
            '  COMPREPLY=($(compgen -W "$words" -- "$word"))',
            "}",
            f"complete -o default -F {function} {program}",
        ]
    )


def _offered(command: Command) -> list[str]:
    return [*command.words, *(name for name, _ in command.options)]


def _zsh(program: str, commands: list[Command]) -> str:
    """Returns the completion for zsh, which reads that of bash."""
    return f"autoload -U +X bashcompinit && bashcompinit\n{_bash(program, commands)}"


def _fish(program: str, commands: list[Command]) -> str:
    """Returns a line for each command and each option, with their help."""
    lines = list[str]()
    for one in commands:
        first, _, second = one.name.partition(" ")
        description = shlex.quote(one.help)
        here = f"__fish_seen_subcommand_from {first}"
        if second:
            lines.append(f"complete -c {program} -n {shlex.quote(here)} -a {second} -d {description}")
            here += f"; and __fish_seen_subcommand_from {second}"
        else:
            lines.append(f"complete -c {program} -n __fish_use_subcommand -a {first} -d {description}")
        if one.words:
            lines.append(f"complete -c {program} -n {shlex.quote(here)} -a {shlex.quote(' '.join(one.words))}")
        for name, said in one.options:
            lines.append(f"complete -c {program} -n {shlex.quote(here)} -l {name[2:]} -d {shlex.quote(said)}")
    return "\n".join(lines)


_SHELLS = {"bash": _bash, "zsh": _zsh, "fish": _fish}
