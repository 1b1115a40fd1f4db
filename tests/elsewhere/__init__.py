"""A running interpreter lacks what other systems lack."""
