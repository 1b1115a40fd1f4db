"""An experiment: one generative likelihood of a session, and what it names. Not shipped; see README.md."""
