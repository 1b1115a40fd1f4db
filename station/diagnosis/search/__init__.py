"""The search for missing physics: where, which effects, and how much each name is believed."""
