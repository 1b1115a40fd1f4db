"""Recordings as a dataset for others: tables, recordings, figures, a card and a citation, in Hugging Face's layout."""
