"""The rows of the fault table, found by being here: each file has `ROWS`, a tuple of `tests.faults.row.Row`."""
