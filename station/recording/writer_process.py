"""A recording that a process of its own writes, so that a simulated session has a processor to itself.

Messages cross a pipe as plain numbers and texts, many at a time: that costs a sixth of encoding and writing them. The
file is the one that `Recording` writes in the same process, byte for byte; a test compares them.
"""

from __future__ import annotations

import contextlib
import gc
import multiprocessing
import pickle
import select
import signal
from collections.abc import Callable, Iterator
from functools import cache, partial
from multiprocessing.connection import Connection
from operator import attrgetter
from pathlib import Path
from typing import Any, cast

from shared.bus import Received, Recipe
from shared.errors import UserError
from shared.fields import slots
from shared.messages import Message
from shared.system.processes import CAN_SPLIT, usable_processors
from station.recording.writer import Recording, require_recorded

BATCH = 128
"""Messages that cross the pipe together: a third of a second of a session, few enough for a processor's cache."""
_OVER = b""
Make = Callable[..., Message]
"""The maker of a message: its class, or the function of a recipe."""
Read = Callable[[Message], tuple[Any, ...]]
"""The function that takes a message apart."""
Apart = tuple[int, tuple[Any, ...] | None]
"""A message within a recipe: the number of its class and its fields, or none of them where the newest one is meant."""
Values = tuple[Any, ...]
"""The fields of a message, nested ones as tuples again; or a recipe's values by name, those that are messages apart."""
Row = tuple[str, int, int, Values]
"""Topic, time of receipt, the number of what makes the message, and of what."""


def can_start_writer_process() -> bool:
    """Returns true if there is a second processor, and a system on which a process can be split in two safely."""
    return CAN_SPLIT and usable_processors() > 1


class WriterProcess:
    """Takes over an open `Recording`. Close it, or use it as a context manager: only then the file is complete.

    When this process dies, the other one finishes the file with what it has.
    """

    def __init__(self, recording: Recording) -> None:
        self.path: Path = recording.path
        """The file; once it is closed the one in which the recording is, if its name was taken meanwhile."""
        self.stopped = ""
        """The reason why the recording had to stop (disk full) or could not be finished, or nothing."""
        context = multiprocessing.get_context("fork")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_write_all, args=(theirs, self._pipe, recording), daemon=True)
        self._process.start()
        theirs.close()
        recording.let_go()
        self._news = select.poll()
        self._news.register(self._pipe, select.POLLIN)
        self._taking = _Packer(self._send)
        self.write = self._taking.add
        """Records one message as it came."""
        self._closed = False

    def __enter__(self) -> WriterProcess:
        """Returns itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Closes the recording.

        Raises:
            UserError: if it had to stop, or could not be finished, and nothing else went wrong.
        """
        self.close()
        require_recorded(self.stopped if kind is None else "")

    def _send(self, data: bytes) -> None:
        """Raises UserError when the other process is gone."""
        try:
            if self._news.poll(0):
                self._hear()
            self._pipe.send_bytes(data)
        except (OSError, EOFError) as error:
            raise self._died() from error

    def _died(self) -> UserError:
        return UserError(
            f"The process that writes {self.path} ended by itself: what it wrote can be saved by `station repair`"
        )

    def close(self) -> Path:
        """Waits until everything is written and the file has its name; closing twice is harmless.

        Raises:
            UserError: if the other process ended without having closed the file.
        """
        if not self._closed:
            self._closed = True
            try:
                self._taking.send()
                self._send(_OVER)
                while not self._hear():
                    pass
            except (EOFError, OSError) as error:
                raise self._died() from error
            finally:
                self._process.join()
                self._pipe.close()
        return self.path

    def _hear(self) -> bool:
        """Takes what the other process says; true if it is the last word, which comes once the file is closed."""
        self.path, self.stopped, closed = self._pipe.recv()
        return bool(closed)


def _write_all(pipe: Connection, other_end: Connection, recording: Recording) -> None:
    """Runs as the other process: writes what comes until it is told that this was all, or nobody is left to say so."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C ends the session, which then closes the recording
    gc.disable()  # nothing here makes cycles of objects, and looking for them would cost a tenth
    other_end.close()
    reported, together = False, _Unpacker()

    def tell(*, closed: bool) -> None:
        with contextlib.suppress(OSError):  # nobody is left to hear it
            pipe.send((recording.path, recording.stopped, closed))

    with contextlib.suppress(EOFError):
        while (data := pipe.recv_bytes()) != _OVER:
            for received in together.batch(data):
                recording.write(received)
            if recording.stopped and not reported:
                reported = True
                tell(closed=False)
    recording.close()
    tell(closed=True)


class _Packer:
    """Turns messages into numbers and texts. What makes them crosses once, when it is new, and then by its number.

    It does so when they come: they have just been made, and a processor still has them at hand.
    """

    def __init__(self, send: Callable[[bytes], None]) -> None:
        self._send_bytes = send
        self._known: dict[Make, tuple[int, Read]] = {}
        self._new: list[Make] = []
        self._rows: list[Row] = []
        self._newest: dict[type[Message], Message] = {}

    def add(self, received: Received) -> None:
        """Takes a message apart, and sends off those that wait when they are enough."""
        rows, recipe = self._rows, received.recipe
        if recipe is None:
            message = received.message
            cls = type(message)
            number, read = self._known.get(cls) or self._learn(cls, _reader(cls))
            self._newest[cls] = message
            rows.append((received.topic, received.receive_ns, number, read(message)))
        else:
            rows.append((received.topic, received.receive_ns, *self._recipe(recipe)))
        if len(rows) >= BATCH:
            self.send()

    def send(self) -> None:
        """Sends off what waits."""
        batch = self._new, self._rows
        self._new, self._rows = [], []
        self._send_bytes(pickle.dumps(batch, pickle.HIGHEST_PROTOCOL))

    def _recipe(self, recipe: Recipe) -> tuple[int, Values]:
        """Returns a recipe; its own messages are taken apart as well, unless the other process has them already."""
        number, _ = self._known.get(recipe.make) or self._learn(recipe.make, _nothing)
        plain, apart = dict[str, Any](), dict[str, Apart]()
        for name, value in recipe.values.items():
            if isinstance(value, Message):
                apart[name] = self._apart(value)
            else:
                plain[name] = value
        return number, (plain, apart)

    def _apart(self, message: Message) -> Apart:
        cls = type(message)
        number, read = self._known.get(cls) or self._learn(cls, _reader(cls))
        return number, None if self._newest.get(cls) is message else read(message)

    def _learn(self, make: Make, read: Read) -> tuple[int, Read]:
        self._known[make] = known = len(self._known), read
        self._new.append(make)
        return known


def _nothing(_: Message) -> tuple[Any, ...]:
    """Returns no fields, as a recipe's function has none."""
    return ()


class _Unpacker:
    """The inverse of `_Packer`."""

    def __init__(self) -> None:
        self._makers: list[Callable[[Any], Message]] = []
        self._newest: dict[int, Message] = {}

    def batch(self, data: bytes) -> Iterator[Received]:
        """Yields the messages of a batch, in its order."""
        batch: tuple[list[Make], list[Row]] = pickle.loads(data)
        new, rows = batch
        for make in new:
            is_class = isinstance(make, type)
            self._makers.append(_maker(cast("type[Message]", make)) if is_class else partial(self._cook, make))
        makers, newest = self._makers, self._newest
        for topic, receive_ns, number, values in rows:
            newest[number] = message = makers[number](values)
            yield Received(topic, receive_ns, message)

    def _cook(self, make: Make, values: tuple[dict[str, Any], dict[str, Apart]]) -> Message:
        plain, apart = values
        for name, (number, parts) in apart.items():
            plain[name] = self._newest[number] if parts is None else self._makers[number](parts)
        return make(**plain)


@cache
def _reader(cls: type[Message]) -> Read:
    """Returns the fields of a message as a tuple."""
    specs = slots(cls)
    if len(specs) == 1:
        only, read_one = specs[0], attrgetter(specs[0].name)
        if not only.nested:
            return lambda message: (read_one(message),)
        inner = _reader(only.kind)
        if only.repeated:
            return lambda message: (tuple(map(inner, read_one(message))),)
        return lambda message: (inner(read_one(message)),)
    read = attrgetter(*(spec.name for spec in specs))
    nested = [(number, spec.repeated, _reader(spec.kind)) for number, spec in enumerate(specs) if spec.nested]
    if not nested:
        return read

    def flatten(message: Message) -> tuple[Any, ...]:
        values = list(read(message))
        for number, repeated, inner in nested:
            values[number] = tuple(map(inner, values[number])) if repeated else inner(values[number])
        return tuple(values)

    return flatten


@cache
def _maker(cls: type[Message]) -> Callable[[tuple[Any, ...]], Message]:
    """Makes the inverse of `_reader`."""
    nested = [(k, spec.repeated, _maker(spec.kind)) for k, spec in enumerate(slots(cls)) if spec.nested]
    if not nested:
        return lambda values: cls(*values)

    def make(values: tuple[Any, ...]) -> Message:
        fields = list(values)
        for number, repeated, inner in nested:
            fields[number] = tuple(map(inner, fields[number])) if repeated else inner(fields[number])
        return cls(*fields)

    return make
