"""Finds the mark's corners in a frame, as exactly as the pixels allow, and says how exactly that was."""
