"""For all tests: how long an example takes says something of the machine, and nothing of the program.

A suite that a script has started in the background is told to ignore Ctrl-C, and whatever it starts would ignore it,
too.
"""

import signal

from hypothesis import settings

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile("repose", deadline=None)
settings.load_profile("repose")
