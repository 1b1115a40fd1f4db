"""`python -m tests.concealed --out FOLDER --tier TIER --cases N --seed S`: makes cases and their sealed key.

The key's hash is printed and written before any recording exists. Cases that exist are left as they are.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

# A case's matrices are small; for them numpy would keep further threads spinning.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from tests.concealed.cases import TIERS, write_case
from tests.concealed.making import make
from tests.concealed.tiers import plan_case


def main(arguments: Sequence[str] | None = None) -> int:
    """Plans all cases, seals the key, then writes what is missing."""
    return make(
        arguments, prog="python -m tests.concealed", about=__doc__, tiers=TIERS, plan=plan_case, write=write_case
    )


if __name__ == "__main__":
    sys.exit(main())
