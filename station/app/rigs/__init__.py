"""Rig files that come with Repose."""
