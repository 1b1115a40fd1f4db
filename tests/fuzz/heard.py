"""Altered messages among good ones, which a live process hears.

An input is a script: at which turn of a rig made of arithmetic which payload comes on which topic. A payload goes
through `wire.decode`, as on the bus, which leaves out what is no message.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random

from shared import topics, wire
from shared.errors import UserError
from shared.messages import Message
from tests.fuzz.target import Unclear
from tests.fuzz.targets.bus import changed

Heard = list[tuple[str, Message]]


def script(good: Callable[[Random, int], Heard], turns: int, turn_ns: int, start_ns: int, random: Random) -> bytes:
    """Turns with payloads, most of them altered, as JSON."""
    count = random.choice((1, 3, 30, 200))
    lines = list[tuple[int, str, str]]()
    for turn in sorted(random.randrange(turns) for _ in range(count)):
        name, message = random.choice(good(random, start_ns + turn * turn_ns))
        payload = wire.encode(message) if random.random() < 0.2 else changed(random, message)
        lines.append((turn, name, payload.hex()))
    return json.dumps(lines).encode()


def heard(path: Path) -> Iterator[tuple[int, str, Message]]:
    """The turn, topic or service, and message of every line that is a message."""
    for turn, name, payload in json.loads(path.read_bytes()):
        cls = topics.SERVICES[name].request if name in topics.SERVICES else topics.topic(name).message
        try:
            yield turn, name, wire.decode(cls, bytes.fromhex(payload))
        except UserError:
            continue


@contextmanager
def never_refused() -> Generator[None]:
    """Turns a UserError into a finding: what comes over the network may end no process, in a sentence neither."""
    try:
        yield
    except UserError as error:
        raise Unclear(f"a message ends the process: {error}") from error


def require_sendable(sent: Iterable[Message]) -> None:
    """Raises Unclear if a message cannot be sent, or is none of its class for whoever gets it."""
    for message in sent:
        try:
            wire.decode(type(message), wire.encode(message))
        except (UserError, ValueError, TypeError) as error:
            raise Unclear(f"it sends what nobody can take: {message} ({error})") from error
