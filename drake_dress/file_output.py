"""Files that commands write: proved writable before work begins, and whole or not there.

Minutes or hours of simulation stand between a command and what it writes. So a place that cannot
be written to is told first, by writing there and taking back what was made.
"""

from __future__ import annotations

import argparse
import errno
import fcntl
import os
import secrets
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from drake_dress.errors import UserError

# What each command writes into its folder. Only these are ever removed there.
RUN_FILES = ("run.h5", "summary.json", "report.html", "replay.html")
EXPLAIN_FILES = ("extended.yaml", "report.html", "explanation.json")
DATASET_FILES = ("measured.h5", "answer.json")
# A file system without locks; two runs there are not told apart.
_NO_LOCKS = (errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP, errno.EINVAL)


def prove_directory(
    option: str, directory: str | Path, names: Sequence[str], inputs: Sequence[str | Path] = ()
) -> Path:
    """Returns a folder, which need not be there yet, once files could be written in it.

    What is made to find out is taken back.

    Args:
        option: that names it, for messages.
        directory: the folder.
        names: of the files that will be written there.
        inputs: files that are read, none of which may be written over.

    Raises:
        UserError: it cannot be written to.
    """
    if not str(directory):
        raise UserError(option, "", "is empty, expected a directory")
    path = Path(directory)
    try:
        if path.exists() and not path.is_dir():
            raise UserError(option, str(path), "is a file, expected a directory")
        with _made(path):
            for name in names:
                _prove(option, path / name, inputs)
    except (OSError, ValueError) as error:
        if isinstance(error, UserError):
            raise
        raise UserError(option, str(path), f"cannot be written to: {_reason(error)}") from error
    return path


def prove_file(option: str, file: str | Path, inputs: Sequence[str | Path] = ()) -> Path:
    """Returns a file, which need not be there yet, once it could be written; see above.

    Raises:
        UserError: it cannot be written.
    """
    if not str(file):
        raise UserError(option, "", "is empty, expected a file")
    path = Path(file)
    try:
        with _made(path.parent):
            _prove(option, path, inputs)
    except (OSError, ValueError) as error:
        if isinstance(error, UserError):
            raise
        raise UserError(option, str(path), f"cannot be written: {_reason(error)}") from error
    return path


def output_file(text: str) -> Path:
    """Returns a file that has proved writable, for argparse: before hours of work, not after."""
    try:
        return prove_file("", text)
    except UserError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def output_folder(text: str) -> Path:
    """Returns a folder in which files can be written, for argparse."""
    try:
        return prove_directory("", text, [])
    except UserError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


@contextmanager
def claimed(option: str, directory: Path, wait: bool = False) -> Iterator[None]:
    """Makes a folder and keeps other commands from writing there meanwhile.

    Args:
        option: that names it, for messages.
        directory: the folder.
        wait: whether to wait for who has claimed it before; otherwise that is an error.

    Raises:
        UserError: another command writes there.
    """
    made = not directory.exists()
    try:
        directory.mkdir(parents=True, exist_ok=True)
        number = os.open(directory, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    except OSError as error:
        message = f"cannot be written to: {_reason(error)}"
        raise UserError(option, str(directory), message) from error
    try:
        try:
            fcntl.flock(number, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        except OSError as error:
            if isinstance(error, BlockingIOError):
                message = "another drake-dress writes there, expected another directory"
                raise UserError(option, str(directory), message) from error
            if error.errno not in _NO_LOCKS:
                raise
        yield
    finally:
        os.close(number)
        if made:
            with suppress(OSError):  # only if nothing was written
                directory.rmdir()


def remove_results(directory: Path, names: Sequence[str]) -> None:
    """Removes what an earlier command left, so that it is not taken for what comes now.

    Raises:
        OSError: it cannot be removed.
    """
    for name in names:
        (directory / name).unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Writes a file so that it is whole or not there."""
    write_bytes(path, text.encode("utf-8", "backslashreplace"))


def write_bytes(path: Path, data: bytes) -> None:
    """Writes a file so that it is whole or not there; makes its folder.

    A pipe or device is written to as it is.
    """
    if path.exists() and not path.is_file():
        path.write_bytes(data)
        return
    with replacing(path) as partial:
        partial.write_bytes(data)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Provides the name of a file to write, which then takes the place of `path`.

    If that fails, nothing of it is left and `path` is as it was.
    """
    # What a symbolic link means is replaced, not the link.
    path = Path(os.path.realpath(path))
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.parent / _short_name()
    try:
        yield partial
        os.replace(partial, path)
    except BaseException:
        with suppress(OSError):
            partial.unlink()
        raise


def _prove(option: str, path: Path, inputs: Sequence[str | Path]) -> None:
    """Makes a file beside `path`, and `path` itself if it is not there; removes both."""
    for other in inputs:
        if path.exists() and os.path.exists(other) and os.path.samefile(path, other):
            raise UserError(option, str(path), "is read, too; expected another place")
    if path.is_dir():
        raise UserError(option, str(path), "is a directory, expected a file or nothing")
    if path.exists() and not path.is_file():
        # a device or a pipe, which would block without a reader
        os.close(os.open(path, os.O_WRONLY | os.O_NONBLOCK | os.O_CLOEXEC))
        return
    target = Path(os.path.realpath(path))
    for made in (target.parent / _short_name(), target):
        try:
            number = os.open(made, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_CLOEXEC, 0o666)
        except FileExistsError:
            if made.is_symlink():  # to itself
                raise
            continue
        os.close(number)
        made.unlink()


@contextmanager
def _made(directory: Path) -> Iterator[None]:
    """Has a folder there meanwhile; removes what was made for it."""
    made: list[Path] = []
    try:
        for folder in (*reversed(directory.parents), directory):
            if not folder.is_dir():
                if folder.exists():
                    raise NotADirectoryError(errno.ENOTDIR, f"{folder} is a file")
                folder.mkdir()
                made.append(folder)
        yield
    finally:
        for folder in reversed(made):
            with suppress(OSError):  # another one may have begun to use it
                folder.rmdir()


def _short_name() -> str:
    # A name of its own: that of the file may already be as long as names can be.
    return f".drake-dress-{secrets.token_hex(6)}.partial"


def _reason(error: OSError | ValueError) -> str:
    if isinstance(error, FileExistsError):
        return "a symbolic link has its name and leads nowhere"
    return (error.strerror if isinstance(error, OSError) else None) or str(error)
