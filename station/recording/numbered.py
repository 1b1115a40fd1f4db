"""Tells by the messages' own numbers which of them a recording lacks: no record of counts is needed for that.

The writer numbers the messages of each topic from 0, through all parts of a session. What was taken from a topic's end
leaves no gap; a recording in which nothing is numbered is another writer's.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping

import numpy as np

from station.recording.batches import Batch
from station.recording.recorded import TopicInfo
from station.recording.unpacking import Integers


class Numbered:
    """Collects the numbers of messages, batch by batch."""

    def __init__(self, *, from_the_first: bool) -> None:
        """`from_the_first` is false for a later part that is read alone, whose numbers begin anywhere."""
        self._from_the_first = from_the_first
        self._numbers: defaultdict[str, list[Integers]] = defaultdict(list)

    def take(self, channels: Mapping[int, TopicInfo], batch: Batch) -> None:
        """Takes the numbers of a batch, of whose channels `channels` tells the topics."""
        for channel in np.unique(batch.channel).tolist():
            self._numbers[channels[channel].name].append(batch.sequence[batch.channel == channel])

    @property
    def by_topic(self) -> dict[str, Integers]:
        """The numbers (n,) of each topic's messages, rising."""
        return {name: np.sort(np.concatenate(numbers)) for name, numbers in sorted(self._numbers.items())}

    def sentences(self) -> Iterator[str]:
        """Yields a sentence for each topic of which messages are missing, or have the number of another one."""
        by_topic = self.by_topic
        if not any(numbers[-1] for numbers in by_topic.values()):
            return
        for name, numbers in by_topic.items():
            different = np.unique(numbers)
            first = 0 if self._from_the_first else int(different[0])
            if missing := int(different[-1]) + 1 - first - len(different):
                yield f"{missing} of the messages on /{name} are missing by their numbers"
            if again := len(numbers) - len(different):
                yield f"{again} of the messages on /{name} have the number of another one"

    @property
    def nothing_numbered(self) -> bool:
        """True if no message has a number, so that none tells of another that is missing."""
        by_topic = self.by_topic
        return any(len(numbers) > 1 for numbers in by_topic.values()) and not any(
            numbers[-1] for numbers in by_topic.values()
        )
