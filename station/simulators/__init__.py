"""Simulated rigs: `planar` (many tilts at once, any effect), `mujoco` (the twin), and the exact slider they answer to.

A recorded session is repeated by any of them through `simulator.simulator(name)`; `recorded_runs` says what is to be
repeated, `observation` what a camera sees of it, `simulated_signals` puts it into the recording's own signals.
"""
