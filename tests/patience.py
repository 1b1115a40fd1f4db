"""A test waits this long for what must happen, and for a process that must end.

A test that passes never waits so long: it looks again and again. On two processors that run eight other programs, or on
an emulated machine, a rig needs minutes to come up, and that is no fault of the rig.
"""

import os

PATIENCE_S = float(os.environ.get("REPOSE_PATIENCE_S", "300"))
