"""One file a format, found by being here: NAME, HELP and export(pairs) -> files. Adding one changes nothing else."""
