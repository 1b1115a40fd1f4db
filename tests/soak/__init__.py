"""What a long session costs: memory, file handles and threads, over hours, as a plot."""
