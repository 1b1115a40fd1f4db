"""Reads a robot's URDF and makes an arm's description of it: `station arm import`.

In order: `reading` reads a stranger's file, `robot` says what links and joints it has, `chain` picks those from base to
tip, `shapes` gives the points of their geometry, `capsule` puts a capsule round them, `model` makes the `ArmModel` and
notes what it estimates, `home` finds a pose that holds the plate level, and `written` writes the TOML.
"""
