"""Every reader and the bus, fed with inputs that nobody should send: `python -m tests.fuzz` (README.md)."""
