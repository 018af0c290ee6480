"""What goes wrong when somebody asks for something: a name nobody knows, a value out of range, an unreadable file."""

from __future__ import annotations

import difflib
import os
from collections.abc import Collection, Mapping
from numbers import Integral
from pathlib import Path
from typing import Any


class AsperityError(ValueError):
    """The base of asperity's errors about what it was given; the command line prints them without a traceback."""


class ParameterError(AsperityError):
    """A parameter is unknown, of the wrong type, out of its range, or at odds with another one."""


class UnknownNameError(AsperityError):
    """A name outside the allowed ones; ``hint`` is what to say of them if they are too many to be told."""

    def __init__(self, what: str, given: str, allowed: Collection[str], hint: str = ""):
        super().__init__(f"unknown {what} {given!r}. {nearest(given, allowed)}{hint or listed(allowed)}")


class UnreadableFileError(AsperityError):
    """A file that is missing, of another format, or damaged."""

    def __init__(self, what: str, path: Path, formats: Collection[str], reason: str):
        super().__init__(f"cannot read the {what} {str(path)!r}: {reason}. Formats: {', '.join(formats)}.")


def suggestion(given: str, allowed: Collection[str]) -> str:
    """The nearest of the allowed names, where one is near, and all of them."""
    return nearest(given, allowed) + listed(allowed)


def nearest(given: str, allowed: Collection[str]) -> str:
    """A question whether the nearest of the allowed names was meant, and a space; nothing if none is near."""
    found = difflib.get_close_matches(str(given), allowed, n=1, cutoff=0.5)
    return f"Did you mean {found[0]!r}? " if found else ""


def listed(allowed: Collection[str]) -> str:
    """The allowed names."""
    return f"Allowed: {', '.join(allowed)}."


def refuse_unused(options: Mapping[str, Any], used: Collection[str], what: str) -> None:
    """Raise ParameterError if an option is given, not None, that would be ignored."""
    for option, value in options.items():
        if value is not None and option not in used:
            raise ParameterError(f"{option}: makes no sense with {what}.")


def refuse_unknown(options: Collection[str], known: Collection[str], what: str) -> None:
    """Raise ParameterError if an option is none of those that ``what`` has."""
    for option in options:
        if option not in known:
            raise ParameterError(f"{option}: makes no sense with {what}. {suggestion(option, known)}")


def whole(name: str, value: Any, least: int, most: int = 2**63 - 1) -> int:
    """A whole number of any type, NumPy's too, within a range; raises ParameterError."""
    if isinstance(value, bool) or not isinstance(value, Integral) or not least <= int(value) <= most:
        end = "" if most == 2**63 - 1 else f" and at most {most}"
        raise ParameterError(f"{name} = {value!r}: expected a whole number, at least {least}{end}.")
    return int(value)


def readable(what: str, path: str | Path, formats: Collection[str]) -> Path:
    """The path of an existing file whose ending is one of ``formats``."""
    path = Path(path)
    if path.suffix.lower() not in formats:
        raise UnreadableFileError(what, path, formats, f"its ending is {path.suffix!r}")
    if not os.path.isfile(path):  # which no name is too long for
        raise UnreadableFileError(what, path, formats, "there is no such file")
    return path
