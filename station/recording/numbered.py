"""Tells by the messages' own numbers which of them a recording lacks: no record of counts is needed for that.

The writer numbers the messages of each topic from 0, through all parts of a session. What was taken from a topic's end
leaves no gap; a recording in which nothing is numbered is another writer's.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from station.recording.parted import is_first
from station.recording.reader import RecordingReader
from station.recording.recorded import TRUTH
from station.recording.unpacking import Integers


@dataclass(frozen=True, eq=False)
class Numbered:
    """The numbers (n,) of each topic's messages, rising.

    `from_the_first` is false for a later part that is read alone, whose numbers begin anywhere.
    """

    by_topic: Mapping[str, Integers]
    from_the_first: bool

    @property
    def count(self) -> int:
        """The number of messages, the simulation's truth not among them."""
        return sum(map(len, self.by_topic.values()))

    def sentences(self) -> Iterator[str]:
        """Yields a sentence for each topic of which messages are missing, or have the number of another one."""
        if not any(numbers[-1] for numbers in self.by_topic.values()):
            return
        for name, numbers in self.by_topic.items():
            different = np.unique(numbers)
            first = 0 if self.from_the_first else int(different[0])
            if missing := int(different[-1]) + 1 - first - len(different):
                yield f"{missing} of the messages on /{name} are missing by their numbers"
            if again := len(numbers) - len(different):
                yield f"{again} of the messages on /{name} have the number of another one"

    @property
    def nothing_numbered(self) -> bool:
        """True if no message has a number, so that none tells of another that is missing."""
        numbers = self.by_topic.values()
        return any(len(one) > 1 for one in numbers) and not any(one[-1] for one in numbers)


def numbered(reader: RecordingReader) -> Numbered:
    """Returns the numbers of all messages of a recording, whose chunks are unpacked for it and their checksums proved.

    Raises:
        UserError: if the file is damaged.
    """
    names = [name for name, info in reader.topics.items() if info.message and not name.startswith(TRUTH)]
    found = defaultdict[str, list[Integers]](list)
    for channels, batch in reader.batches(names):
        for channel in np.unique(batch.channel).tolist():
            found[channels[channel].name].append(batch.sequence[batch.channel == channel])
    rising = {name: np.sort(np.concatenate(numbers)) for name, numbers in sorted(found.items())}
    return Numbered(rising, from_the_first=is_first(reader))
