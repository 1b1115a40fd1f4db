"""Messages of a recovered topic that come twice: after a restart or a lost link its cache gives some again."""

from collections import deque


class Repeats:
    """Knows the last `size` messages of a topic by the stamps that their senders gave them, of which no two are alike.

    The same bytes under another stamp are another message: a recording that is played a second time, say.
    """

    def __init__(self, size: int) -> None:
        self._order: deque[str] = deque()
        self._known: set[str] = set()
        self._size = size

    def seen(self, stamp: str) -> bool:
        """Returns true if the stamp is one of the last, and remembers it otherwise."""
        if stamp in self._known:
            return True
        self._known.add(stamp)
        self._order.append(stamp)
        if len(self._order) > self._size:
            self._known.discard(self._order.popleft())
        return False
