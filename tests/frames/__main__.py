"""`python -m tests.frames --out FOLDER --tier TIER --cases N --seed S`: makes cases in MuJoCo, and their sealed key.

The key's hash is printed and written before any recording exists. Cases that exist are left as they are.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

# A session's matrices are small; for them numpy would keep further threads spinning.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from tests.concealed.making import make
from tests.frames.cases import TIERS, plan_case, write_case


def main(arguments: Sequence[str] | None = None) -> int:
    """Plans all cases, seals the key, then writes what is missing."""
    return make(arguments, prog="python -m tests.frames", about=__doc__, tiers=TIERS, plan=plan_case, write=write_case)


if __name__ == "__main__":
    sys.exit(main())
