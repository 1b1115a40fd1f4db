"""Simulated rigs: the exact planar slider and the MuJoCo twin."""
