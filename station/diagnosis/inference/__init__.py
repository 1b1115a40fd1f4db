"""Fits of models by maximum likelihood: parameters, standard errors, score tests, and their calibration."""
