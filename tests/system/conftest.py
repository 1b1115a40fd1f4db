"""Fixtures of the tests with processes of their own."""

from tests.system.live_rig import one_rig, rig

__all__ = ["one_rig", "rig"]
