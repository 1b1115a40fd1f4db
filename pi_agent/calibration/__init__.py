"""Turns pixels into places on the plate: measured by `pi-agent calibrate`, kept as TOML beside the rig file."""
