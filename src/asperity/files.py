"""Files that are whole, or not there, and that one command at a time writes."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryFile

from .errors import AsperityError, ParameterError

try:
    import fcntl
except ImportError:  # on Windows, where nothing is locked
    fcntl = None  # type: ignore[assignment]


class TakenError(AsperityError):
    """A file that must not be written: it is there, or somebody else is writing it."""


@contextmanager
def atomically(path: Path) -> Iterator[Path]:
    """A file beside ``path`` to write to, which takes its place in the end, or vanishes.

    A link stays one: the file that it leads to is replaced.
    """
    path = Path(os.path.realpath(path))
    part = path.with_name(f".{path.stem}-{os.getpid()}{path.suffix}")
    try:
        yield part
        if path.exists():
            shutil.copymode(path, part)
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Keep others who lock ``path`` from writing it meanwhile; raises TakenError if one of them does so now.

    The lock is a hidden file beside it. The system unlocks it when the process ends, however it ends.
    """
    real = Path(os.path.realpath(path))
    lock = real.with_name(f".{real.name}.lock")
    while fcntl is not None:
        # Reading is enough to lock, and all that one may do to a file that another user's killed process left.
        file = os.open(lock, os.O_RDONLY | os.O_CREAT, 0o666)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(file)
            raise TakenError(f"{path}: another asperity is writing it.") from None
        except OSError:  # a file system without locks
            pass
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(file), os.stat(lock)):
                break
        os.close(file)  # of a lock that was given back, and removed, just before
    try:
        yield
    finally:
        if fcntl is not None:
            with suppress(OSError):
                lock.unlink()
            os.close(file)


def check_folder(out: Path, name: str) -> None:
    """Raise ParameterError if nothing can be written beside ``out``."""
    parent = out.resolve().parent
    try:
        with TemporaryFile(dir=parent):
            pass
    except OSError as error:
        raise ParameterError(
            f"{name} {out}: cannot write into the folder {str(out.parent)!r}: {error.strerror}."
        ) from error


def folder(path: str | Path, name: str) -> Path:
    """The folder of that path, which is made if it is not there; raises ParameterError, as ``name`` = path."""
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ParameterError(f"{name} = {str(path)!r}: cannot make this folder: {error.strerror}.") from error
    return path
