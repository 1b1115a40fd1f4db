"""Shows a session to a terminal or a script while it runs."""
