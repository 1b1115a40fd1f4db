"""Free numbers, fits under the likelihood, their errors, and what a fitted model would score by chance."""
