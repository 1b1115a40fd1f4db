"""Measuring friction from signals: onset, filters, limit curves. Nothing here knows what explains friction."""
