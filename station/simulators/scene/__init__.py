"""A MuJoCo scene of the user's own, driven with a recorded attitude."""
