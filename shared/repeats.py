"""Messages of a recovered topic that come twice: after a restart or a lost link its cache gives some again."""

from collections import deque


class Repeats:
    """Knows the last `size` payloads of a topic.

    A message is the same when its bytes are, which hold boot id, sequence number and capture time.
    """

    def __init__(self, size: int) -> None:
        self._order: deque[bytes] = deque()
        self._known: set[bytes] = set()
        self._size = size

    def seen(self, payload: bytes) -> bool:
        """Returns true if the payload is one of the last, and remembers it otherwise."""
        if payload in self._known:
            return True
        self._known.add(payload)
        self._order.append(payload)
        if len(self._order) > self._size:
            self._known.discard(self._order.popleft())
        return False
