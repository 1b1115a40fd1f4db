"""The likelihood: residuals and their slopes, the noise and its covariance, and Student's t for whitened components."""
