"""Output files of commands: checked for writability in advance, and written atomically.

A command may simulate for minutes or hours before it writes. Therefore, a location that is not
writable is reported first, by creating files there and removing them again.
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

# Files that each command writes into its folder. Only these are ever removed there.
RUN_FILES = ("run.h5", "summary.json", "report.html", "replay.html")
EXPLAIN_FILES = ("extended.yaml", "report.html", "explanation.json")
GARMENT_FILES = ("garment.html", "garment.json", "garment.yaml")
DATASET_FILES = ("measured.h5", "answer.json")
# Attempts to make a folder next to another command that makes and removes the same one.
_ATTEMPTS = 50
# The file system has no locks; two commands there cannot be detected.
_NO_LOCKS = (errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP, errno.EINVAL)


def prove_directory(
    option: str, directory: str | Path, names: Sequence[str], inputs: Sequence[str | Path] = ()
) -> Path:
    """Checks that files can be written in a folder, and returns it; it need not exist.

    Files and folders created for the check are removed.

    Args:
        option: Option that names the folder, for messages.
        directory: The folder.
        names: Names of the files that will be written there.
        inputs: Input files, none of which may be overwritten.

    Raises:
        UserError: The folder is not writable.
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
    """Checks that a file can be written, and returns it; like `prove_directory`.

    Raises:
        UserError: The file cannot be written.
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
    """Returns a file after checking that it is writable; an argparse type."""
    try:
        return prove_file("", text)
    except UserError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def output_folder(text: str) -> Path:
    """Returns a folder after checking that it is writable; an argparse type."""
    try:
        return prove_directory("", text, [])
    except UserError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


@contextmanager
def claimed(option: str, directory: Path, wait: bool = False) -> Iterator[None]:
    """Creates a folder and locks it against other commands inside the context.

    Args:
        option: Option that names the folder, for messages.
        directory: The folder.
        wait: Whether to wait for another command that holds the lock, rather than to fail.

    Raises:
        UserError: Another command writes there.
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
    """Removes the results of an earlier command, so that they are not taken for new ones.

    Raises:
        OSError: A file cannot be removed.
    """
    for name in names:
        (directory / name).unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Writes a text file atomically."""
    write_bytes(path, text.encode("utf-8", "backslashreplace"))


def write_bytes(path: Path, data: bytes) -> None:
    """Writes a file atomically and creates its folder.

    A pipe or device is written to directly.
    """
    if path.exists() and not path.is_file():
        path.write_bytes(data)
        return
    with replacing(path) as partial:
        partial.write_bytes(data)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yields the name of a temporary file to write, which then replaces `path`.

    On failure the temporary file is removed and `path` is unchanged.
    """
    # Replace the target of a symbolic link, not the link.
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
    """Creates a file next to `path`, and `path` if it does not exist; removes both."""
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
            if made.is_symlink():  # a link to itself
                raise
            continue
        os.close(number)
        made.unlink()


@contextmanager
def _made(directory: Path) -> Iterator[None]:
    """Creates a folder for the duration of the context; removes the folders created."""
    made: list[Path] = []
    try:
        for attempt in range(_ATTEMPTS):
            try:
                _make_all(directory, made)
                break
            except FileNotFoundError:  # another process has just removed one of the folders
                if attempt == _ATTEMPTS - 1:
                    raise
        yield
    finally:
        for folder in reversed(made):
            with suppress(OSError):  # another process may have started to use it
                folder.rmdir()


def _make_all(directory: Path, made: list[Path]) -> None:
    """Creates a folder with its parents, and adds those that it created to `made`."""
    for folder in (*reversed(directory.parents), directory):
        if folder.is_dir():
            continue
        if folder.exists():
            raise NotADirectoryError(errno.ENOTDIR, f"{folder} is a file")
        try:
            folder.mkdir()
        except FileExistsError:
            if folder.is_symlink():
                raise
            continue  # another process has just made it
        made.append(folder)


def _short_name() -> str:
    # Not derived from the file's name, which may already have the maximum length.
    return f".drake-dress-{secrets.token_hex(6)}.partial"


def _reason(error: OSError | ValueError) -> str:
    if isinstance(error, FileExistsError):
        return "a symbolic link has its name and leads nowhere"
    return (error.strerror if isinstance(error, OSError) else None) or str(error)
