"""A long session costs memory, file handles and threads; it is watched over hours and drawn as a plot."""
