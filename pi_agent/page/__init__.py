"""The page on the Pi, for focus, exposure and calibration: the camera's picture now, and how good it is."""
