"""For all tests: how long an example takes says something of the machine, and nothing of the program."""

from hypothesis import settings

settings.register_profile("repose", deadline=None)
settings.load_profile("repose")
