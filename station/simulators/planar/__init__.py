"""The planar simulator: blocks that stick and slip exactly, with every effect, tens of thousands of tilts a second.

`simulate` follows many runs at once (`ramps` or recorded `tracks`); `session` runs a recorded session again.
"""
