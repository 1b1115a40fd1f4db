"""The search for missing physics: where residuals stand out, which effects explain them, and how probable each is."""
