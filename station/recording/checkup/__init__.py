"""Examines a recording: what arrived, when, how late, what is missing, and which rules of the format it breaks."""
