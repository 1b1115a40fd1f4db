"""The likelihood: noise with a draw of friction for every run, heavy tails, and the fits under it."""
