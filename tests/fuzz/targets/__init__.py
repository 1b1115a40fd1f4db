"""What is fuzzed, one file a family, found by being here: each has `TARGETS`, a tuple of `tests.fuzz.target.Target`."""
