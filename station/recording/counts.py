"""Compares what a file holds with what its writer counted: the metadata record `messages`, by topic.

A file that was never finished has no such record, nor has one of an older version. The simulation's truth is not
counted: it may be taken out of a recording without a trace.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from station.recording.provenance import whole_number

METADATA = "messages"
"""The name of the record; its lines have the topics' names as in the file, with their slash."""
TRUTH = "/truth/"


def counts_record(counts: Mapping[str, int]) -> dict[str, str]:
    """Returns the record for the number of messages by topic, named as on the bus."""
    named = {f"/{topic}": count for topic, count in sorted(counts.items())}
    return {name: str(count) for name, count in named.items() if not name.startswith(TRUTH)}


def miscounted(record: Mapping[str, str], held: Mapping[str, int]) -> Iterator[str]:
    """Yields a sentence for each topic of which a file holds more or fewer messages than its record says.

    Args:
        record: the lines of the metadata record, without its checksum; empty where a file has none.
        held: the number of messages by topic, named as on the bus.
    """
    written = {name: whole_number(count) for name, count in record.items() if name.startswith("/")}
    found = {f"/{topic}": count for topic, count in held.items() if written and not f"/{topic}".startswith(TRUTH)}
    for name in sorted(written.keys() | found.keys()):
        expected, count = written.get(name, 0), found.get(name, 0)
        if expected != count:
            yield f"expected {'a number of' if expected is None else expected} messages on {name}, found {count}"
