"""Recordings of the MuJoCo twin in which an effect is concealed, through frames, tracker, bus and recorder."""
