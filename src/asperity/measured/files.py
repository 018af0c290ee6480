"""What all readers of files share: a file that is one, of bounded size, and errors that name it."""

from __future__ import annotations

import os
import stat
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from ..errors import AsperityError, UnreadableFileError

MOST = 2**31
"""Bytes of a file, and of what it unpacks to: forty times a file of the MERL database."""


@contextmanager
def reading(path: str | Path, formats: Collection[str]) -> Iterator[Path]:
    """The path of an ordinary file, neither empty nor huge; what goes wrong with it is an UnreadableFileError."""
    path = Path(path)
    if reason := _reason(path, formats):
        raise UnreadableFileError("measurement", path, formats, reason)
    try:
        yield path
    except UnreadableFileError:
        raise
    except (AsperityError, OSError, MemoryError) as error:
        reason = "it does not fit into the memory" if isinstance(error, MemoryError) else str(error)
        raise UnreadableFileError("measurement", path, formats, reason) from error


def _reason(path: Path, formats: Collection[str]) -> str | None:
    """Why a file is not even opened; None if it is."""
    if path.suffix.lower() not in formats:
        return f"its ending is {path.suffix!r}"
    try:
        found = os.stat(path)
    except OSError:  # missing, or its name is too long
        return "there is no such file"
    if stat.S_ISDIR(found.st_mode):
        return "it is a folder"
    if not stat.S_ISREG(found.st_mode):  # opening a fifo would wait
        return "it is no ordinary file"
    if not found.st_size:
        return "it is empty"
    return f"it has {found.st_size} bytes, more than {MOST}" if found.st_size > MOST else None
