"""The page on the Pi, for focus, exposure and calibration: what the camera sees now, and how good that is."""
