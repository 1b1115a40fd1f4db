"""The evidence of a recording: rows of measurements with noise, which a model predicts."""
