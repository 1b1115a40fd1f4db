"""Has the cases made by a family's generator: another process, of which only paths and hashes are known here."""

from __future__ import annotations

import hashlib
import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from shared.errors import UserError
from tests.proof.families import Family
from tests.proof.protocol import Protocol

ROOT = Path(__file__).resolve().parents[2]
KEY = "key.json"
_HASH = re.compile(r"\b([0-9a-f]{64})\b")
Tell = Callable[[str, int, int], None]
"""Tells what is done, how much of it, of how much."""


def require_generator(module: str) -> None:
    """Raises a UserError where there is no such generator."""
    place = ROOT.joinpath(*module.split("."))
    if not ((place / "__main__.py").exists() or place.with_suffix(".py").exists()):
        raise UserError(
            f"Expected the generator of the cases in {place}, found none; the proof needs a whole checkout of the "
            "repository"
        )


def make_tier(family: Family, protocol: Protocol, tier: str, *, jobs: int, tell: Tell) -> str | None:
    """Makes a tier's cases, those that are missing; None, or the reason why there are none.

    The hash of the key is written to `protocol.seals` before this returns; a key that changed is refused. What is
    sealed and complete is left alone: planning it again takes as long as writing it.

    Raises:
        UserError: if the folder holds a key of other cases.
    """
    module, *own = family.generator()
    require_generator(module)
    if _is_made(family, protocol, tier):
        return None
    asked = {"tier": tier, "cases": protocol.tiers[tier], "seed": protocol.seed, "jobs": jobs}
    folders = {"out": protocol.cases(tier).resolve(), "key": protocol.key(tier).resolve()}
    words = [word for name, value in (asked | folders).items() for word in (f"--{name}", str(value))]
    status, said, last = _run([sys.executable, "-m", module, *own, *words], tell)
    if status == 2:
        raise UserError(last)
    digest = _HASH.search(said)
    if status != 0 or digest is None:
        return f"the generator made no cases: {last}"
    _seal(protocol, tier, digest.group(1))
    return None


def _is_made(family: Family, protocol: Protocol, tier: str) -> bool:
    """True if all cases that are asked for are there, with the key that was sealed."""
    key = protocol.key(tier) / KEY
    if not (protocol.seals.exists() and key.exists()):
        return False
    text = key.read_bytes()
    sealed: dict[str, str] = json.loads(protocol.seals.read_text("utf-8"))
    told = json.loads(text)
    asked = (told.get("seed"), len(told["cases"]), told.get("only")) == (protocol.seed, protocol.tiers[tier], [])
    same = sealed.get(tier) == hashlib.sha256(text).hexdigest()
    return asked and same and all(family.complete(protocol, tier, case) for case in family.names(told))


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
