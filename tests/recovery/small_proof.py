"""`make proof` with a quick protocol that is smaller still: `python -m tests.recovery.small_proof …`.

Every tier of the first family's quick protocol is in it, so that every way to score a case is gone. Single effects come
at 0.5, 1, 2 and 4 times their limits in turn: four of them have all strengths, and the same two strong ones as the
quick protocol. Sessions are short (`short_cases`).
"""

import sys
from types import MappingProxyType

from tests.proof.__main__ import main
from tests.proof.families.own import Own

SMALL = MappingProxyType({"null": 3, "single": 4, "outside": 1, "absorbed": 1, "confounded": 1})

if __name__ == "__main__":
    Own.quick = SMALL
    Own.generator = lambda self: ["tests.recovery.short_cases"]  # noqa: ARG005  # as a method
    sys.exit(main(["--family", "own", *sys.argv[1:]]))
