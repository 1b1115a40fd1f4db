"""Concealed recordings of a block on many bristles: a second generator, written from the physics alone (README.md)."""
