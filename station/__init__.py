"""The laptop's side: arm, sampling, recording, views, analysis."""
