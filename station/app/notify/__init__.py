"""Tells somebody that a session needs them, or that it is over: `[notify]` of the rig file."""
