"""Each code block that the READMEs show is run, read or parsed by a test."""
