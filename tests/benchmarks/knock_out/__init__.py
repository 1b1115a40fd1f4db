"""The same evidence with every rule of the diagnosis, and with one switched off, shows which rules save cases."""
