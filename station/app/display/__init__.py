"""What a terminal or a script gets to see of a session while it runs."""
