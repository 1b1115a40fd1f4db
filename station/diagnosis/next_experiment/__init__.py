"""The next experiment: the cheapest plan that separates what a recording cannot tell apart."""
