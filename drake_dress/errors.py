"""Errors that the command line reports in one line, with their exit status."""

# Maximum lengths of the parts of the line: path, key, message.
_SOURCE, _KEY, _MESSAGE = 1000, 100, 300


class UserError(ValueError):
    """Unusable input, with its file (or argument) and key; exit status 2.

    The line is readable for any input: white space is collapsed, control characters are escaped,
    and the middle of a long part is left out.

    Args:
        source: File name or command-line argument that the input came from.
        key: Dotted key, mesh element or field inside the source; may be empty.
        message: The value found, and what was expected instead.
    """

    def __init__(self, source: str, key: str, message: str) -> None:
        self.source = source
        self.key = key
        self.message = _in_one_line(message, _MESSAGE)
        parts = (_in_one_line(source, _SOURCE), _in_one_line(key, _KEY), self.message)
        super().__init__(": ".join(part for part in parts if part))


class FailedError(RuntimeError):
    """The command ran but failed, for a reason given in one line; exit status 1."""


def _in_one_line(text: str, longest: int) -> str:
    # cut first, so that very long text is cheap
    if len(text) > 4 * longest:
        text = f"{text[: 2 * longest]} {text[-2 * longest :]}"
    line = "".join(c if c.isprintable() else repr(c)[1:-1] for c in " ".join(text.split()))
    if len(line) <= longest:
        return line
    return f"{line[: longest * 2 // 3]} … {line[-(longest // 3) :]}"
