"""Which rules of the diagnosis save cases: the same evidence with every rule, and with one of them switched off."""
