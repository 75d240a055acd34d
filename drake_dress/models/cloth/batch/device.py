"""Warp, started without a banner, and the devices it runs on."""

from __future__ import annotations

import os
import re

import warp as wp

from drake_dress.errors import UserError


def find_device(name: str) -> wp.Device:
    """Returns the device called `name`.

    Args:
        name: `cpu`, `cuda` (the first CUDA device) or `cuda:N`.

    Raises:
        UserError: there is no such device here.
    """
    found = re.fullmatch(r"cpu|cuda(?::(\d+))?", name) if isinstance(name, str) else None
    if found is None:
        raise UserError("device", "", f"is {name!r}, expected cpu, cuda or cuda:N")
    _start()
    if name == "cpu":
        return wp.get_device("cpu")
    # Asking Warp for a CUDA device that is not there makes its driver layer print to stderr.
    count = wp.get_cuda_device_count() if wp.is_cuda_available() else 0
    index = int(found.group(1) or 0)
    if index >= count:
        there = ", ".join(["cpu", *(f"cuda:{i}" for i in range(count))])
        raise UserError("device", "", f"is {name!r}, which is not here; expected one of {there}")
    return wp.get_device(f"cuda:{index}")


def cuda_is_available() -> bool:
    """Returns whether Warp finds a CUDA device."""
    _start()
    return bool(wp.is_cuda_available())


_started = False


def _start() -> None:
    """Starts Warp once, without its banner and without its driver's remark that there is no GPU.

    The remark comes from native code that writes to file descriptor 2, so no Python setting
    holds it back. Warnings and errors of later calls are not touched.
    """
    global _started
    if _started:
        return
    wp.config.log_level = max(wp.config.log_level, wp.LOG_WARNING)
    saved = os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        wp.init()
    finally:
        os.dup2(saved, 2)
        os.close(saved)
        os.close(nowhere)
    _started = True
