"""The fault table: real processes on real links, and what a fault costs: `make faults` (README.md)."""
