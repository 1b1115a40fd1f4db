"""Limit curves and the scatter of friction, by maximum likelihood on the onset angle and the slide's direction."""
