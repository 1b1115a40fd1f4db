"""What acts on the block beyond a plain simulation: one file an effect, each vanishing at its null value."""
