"""A simulator of the user's own, as a function that is called for each run."""
