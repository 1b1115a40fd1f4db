"""One file a command, found by being here: NAME, HELP, add_arguments(parser) and run(arguments) -> exit status."""
