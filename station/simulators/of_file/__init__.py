"""Simulators of the user's own, one module for each kind of file that they come in, named after its suffix."""
