"""What the user gave cannot be used: told in one line, exit status 2."""

# Most characters of a part of the line: a path, a key, what is wrong.
_SOURCE, _KEY, _MESSAGE = 1000, 100, 300


class UserError(ValueError):
    """Unusable input, with the file (or argument) and the key where it was found.

    The line is readable whatever the input holds: white space is collapsed, control characters are
    escaped, and the middle of a long part is left out.

    Args:
        source: file name or command-line argument the input came from.
        key: dotted key, mesh element or field inside the source; may be empty.
        message: what came and what was expected instead.
    """

    def __init__(self, source: str, key: str, message: str) -> None:
        self.source = source
        self.key = key
        self.message = _in_one_line(message, _MESSAGE)
        parts = (_in_one_line(source, _SOURCE), _in_one_line(key, _KEY), self.message)
        super().__init__(": ".join(part for part in parts if part))


class FailedError(RuntimeError):
    """What was asked for ran and did not succeed, for a reason told in one line: exit status 1."""


def _in_one_line(text: str, longest: int) -> str:
    # far more than is shown need not be looked at
    if len(text) > 4 * longest:
        text = f"{text[: 2 * longest]} {text[-2 * longest :]}"
    line = "".join(c if c.isprintable() else repr(c)[1:-1] for c in " ".join(text.split()))
    if len(line) <= longest:
        return line
    return f"{line[: longest * 2 // 3]} … {line[-(longest // 3) :]}"
