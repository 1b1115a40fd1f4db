"""Frames with known corners under stated conditions, and the other methods that ours is compared with."""
