"""The plan that would tell apart what a recording cannot."""
