"""The physics of a block on a plate: one file for each effect beyond a plain simulation, neutral at its null value."""
