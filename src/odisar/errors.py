"""The one exception that the command line turns into a sentence instead of a traceback."""


class OdisarError(Exception):
    """Something the user can mend: the message says what is wrong, where, and the way out."""
