"""The likelihood: what scatters in a recording, and how far the measurements lie from what a model says."""
