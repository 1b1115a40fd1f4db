"""The description of the rig: arm models and where things stand, as numbers without behaviour."""
