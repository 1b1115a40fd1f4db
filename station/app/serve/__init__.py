"""The page in the browser: a running session, its controls, and the recordings of a folder."""
