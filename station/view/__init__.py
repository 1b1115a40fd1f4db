"""Shows messages to a person: one logger of messages into Rerun, for recordings and for a session that is running."""
