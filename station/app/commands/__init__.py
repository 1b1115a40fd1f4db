"""One file a command, found by being here: NAME, HELP, EXAMPLE, add_arguments(parser), run(arguments) -> exit status.

NAME, HELP and EXAMPLE are one line each. Where there are such, so are ONE, what an exit status of 1 means, and STOPPED,
what Ctrl-C gives instead of 130. Tests run every example: it is a line of a README, or stands in
tests/readmes/test_shell.py.
"""
