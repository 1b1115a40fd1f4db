"""The pages that our programs show in a browser: who is let in, the server behind them, and their common look."""
