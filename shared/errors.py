"""The one exception that a user sees."""


class UserError(Exception):
    """A mistake or a fault that the user can mend.

    Its text is one clear sentence: what was expected, what came, what to do. The commands print it without a traceback
    and end with exit status 2.
    """
