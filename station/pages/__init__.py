"""Gives every page that the station writes one look: on a light screen, on a dark one, and on paper."""
