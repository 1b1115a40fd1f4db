"""Has the cases made by the generators: another process, of which only paths and hashes are known here."""

from __future__ import annotations

import hashlib
import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from shared.errors import UserError
from station.prove.protocol import THROUGH, Protocol

INDEPENDENT, THROUGH_EVERYTHING = "tests.concealed", "tests.frames"
"""The generator that shares nothing with the tool, and the one that is the rig itself, simulated."""
ROOT = Path(__file__).resolve().parents[2]
_HASH = re.compile(r"^key sha256 ([0-9a-f]{64})$", re.MULTILINE)
Tell = Callable[[str, int, int], None]
"""What is done, how much of it, of how much."""


def module_of(tier: str) -> str:
    """The generator of a tier."""
    return THROUGH_EVERYTHING if tier in THROUGH else INDEPENDENT


def require_generator(module: str) -> None:
    """Raises a UserError where there is no checkout with the generator."""
    folder = ROOT.joinpath(*module.split("."))
    if not (folder / "__main__.py").exists():
        raise UserError(
            f"Expected the generator of the cases in {folder}, found none; `station prove` needs "
            "a checkout of the repository, not an installed package"
        )


def make_tier(protocol: Protocol, tier: str, *, jobs: int, tell: Tell) -> str | None:
    """Makes a tier's cases, those that are missing; None, or the reason why there are none.

    The hash of the key is written to `protocol.seals` before this returns; a key that changed is refused. What is
    sealed and complete is left alone: planning it again takes as long as writing it.

    Raises:
        UserError: if the folder holds a key of other cases.
    """
    module = module_of(tier)
    require_generator(module)
    if _is_made(protocol, tier):
        return None
    command = [
        sys.executable,
        "-m",
        module,
        "--tier",
        tier,
        "--cases",
        str(protocol.tiers[tier]),
        "--seed",
        str(protocol.seed),
        "--jobs",
        str(jobs),
        "--out",
        str(protocol.cases(tier).resolve()),
        "--key",
        str(protocol.key(tier).resolve()),
    ]
    status, said, last = _run(command, tell)
    if status == 2:
        raise UserError(last)
    digest = _HASH.search(said)
    if status != 0 or digest is None:
        return f"the generator made no cases: {last}"
    _seal(protocol, tier, digest.group(1))
    return None


def _is_made(protocol: Protocol, tier: str) -> bool:
    """True if all cases that are asked for are there, with the key that was sealed."""
    key = protocol.key(tier) / "key.json"
    if not (protocol.seals.exists() and key.exists()):
        return False
    text = key.read_bytes()
    sealed: dict[str, str] = json.loads(protocol.seals.read_text("utf-8"))
    told = json.loads(text)
    asked = (told.get("seed"), len(told["cases"]), told.get("only")) == (protocol.seed, protocol.tiers[tier], [])
    same = sealed.get(tier) == hashlib.sha256(text).hexdigest()
    return asked and same and all((protocol.cases(tier) / case / "session.mcap").exists() for case in told["cases"])


def _run(command: list[str], tell: Tell) -> tuple[int, str, str]:
    """Exit status, standard output, last line of standard error."""
    last = ""
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, encoding="utf-8"
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        try:
            for line in process.stderr:
                last = line.strip() or last
                step = re.fullmatch(r"(\w+) (\d+) of (\d+)", last)
                if step:
                    tell(step.group(1), int(step.group(2)), int(step.group(3)))
            said = process.stdout.read()
        except BaseException:
            process.terminate()
            raise
    return process.returncode, said, last


def _seal(protocol: Protocol, tier: str, digest: str) -> None:
    known: dict[str, str] = json.loads(protocol.seals.read_text("utf-8")) if protocol.seals.exists() else {}
    if known.get(tier, digest) != digest:
        raise UserError(
            f"Expected the key of tier {tier} that was sealed in {protocol.seals}, got another one; choose a new folder"
        )
    protocol.seals.write_text(json.dumps(known | {tier: digest}, indent=1) + "\n", encoding="utf-8")
