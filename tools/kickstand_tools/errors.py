"""What the command line refuses."""


class InputError(Exception):
    """Something the user gave cannot be used. The text is one line: what is wrong, and what to do."""


def cause(error: BaseException) -> str:
    """A short reason for an error of the operating system, without its number: "Permission denied"."""
    return getattr(error, "strerror", None) or str(error) or type(error).__name__
