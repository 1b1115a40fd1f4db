"""Recordings: one MCAP file a session, the only record. This package is the only one that knows the mcap library."""
