"""What the user gave cannot be used: told in one line, exit status 2."""


class UserError(ValueError):
    """Unusable input, with the file (or argument) and the key where it was found.

    Args:
        source: file name or command-line argument the input came from.
        key: dotted key, mesh element or field inside the source; may be empty.
        message: what came and what was expected instead.
    """

    def __init__(self, source: str, key: str, message: str) -> None:
        self.source = source
        self.key = key
        self.message = " ".join(message.split())
        super().__init__(": ".join(part for part in (source, key, self.message) if part))


class FailedError(RuntimeError):
    """What was asked for ran and did not succeed, for a reason told in one line: exit status 1."""
