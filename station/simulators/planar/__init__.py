"""The fast planar simulator: a block that sticks and slips exactly, tens of thousands of tilts a second."""
