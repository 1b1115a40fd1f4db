"""One file a command, found by being here: NAME, HELP, EXAMPLE, add_arguments(parser), run(arguments) -> exit status.

NAME, HELP and EXAMPLE are one line each. Tests run every example: it is a line of a README, or stands in
tests/readmes/test_shell.py.
"""
