"""What the READMEs show: each code block is run, read or parsed by a test."""
