"""A Meshcat page on this machine."""

from __future__ import annotations

import errno
import socket

from pydrake.geometry import Meshcat, MeshcatParams

from drake_dress.errors import UserError

# Range in which Meshcat looks for a port if none is given.
_FIRST, _LAST = 7000, 7999


def open_page(port: int | None = None) -> Meshcat:
    """Opens a Meshcat page that listens on localhost only.

    Args:
        port: Port from 1024 to 65535; None: the first free one from 7000.

    Raises:
        UserError: The port is in use or cannot be opened, or no port is free.
    """
    try:
        return Meshcat(MeshcatParams(host="localhost", port=port))
    except RuntimeError as error:
        if port is None:
            message = f"no port from {_FIRST} to {_LAST} is free, expected a free one"
        else:
            message = f"port {port} {_problem(port)}, expected a free one"
        raise UserError("--port", "", message) from error


def _problem(port: int) -> str:
    with socket.socket() as probe:
        try:
            probe.bind(("localhost", port))
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                return f"cannot be opened: {error.strerror}"
    return "is in use"
