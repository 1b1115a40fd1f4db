"""The gap between recording and simulation: where it is, which physics it is, and how far that closes it."""
