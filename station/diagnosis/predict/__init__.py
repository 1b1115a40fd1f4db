"""Predictions of held-out runs, before and after, and the slides that are simulated again."""
