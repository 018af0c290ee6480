"""The files that commands write: whole, or not at all, and never over something of the user's that was not to go."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity.errors import ParameterError
from asperity.files import TakenError, atomically, check_folder, locked

from . import channels

if TYPE_CHECKING:
    import numpy as np

Force = Annotated[
    bool,
    typer.Option("--force", help="Overwrite. Without it, what -o names must be new, and default names get numbers."),
]

NAME = Path("asperity")
FORMATS = (".png", ".exr")
DESCRIPTIONS = (".json", ".xml")
"""Inputs that may name further ones: textures, say."""


@contextmanager
def files(
    out: Path | None,
    default: Path,
    formats: Sequence[str],
    *,
    force: bool = False,
    inputs: Iterable[Path | str | None] = (),
    option: str = "-o",
) -> Iterator[list[Path]]:
    """The files to write: ``out``, or ``default`` in that folder, or here; no other command writes them meanwhile.

    Without an ending, ``out`` gets that of ``default``, or all, if that has none. Nothing is overwritten unasked: a
    name that the user gave is refused if it is taken, unless by ``force``; a default one gets a number. Inputs are
    never overwritten: paths, what the scenes among them name, and what options (words) name.
    """
    named = out is not None and not out.is_dir()
    path = default if out is None else out if named else out / default.name
    if path.suffix and path.suffix.lower() not in formats:
        raise ParameterError(f"{option} {path}: the ending is {path.suffix!r}. Allowed: {', '.join(formats)}.")
    check_folder(path, option)
    ending = path.suffix or default.suffix
    endings = [ending] if ending else formats
    candidates = ([path.with_name(f"{path.stem}{n}{ending}") for ending in endings] for n in numbers())
    with first_free(candidates, named, lambda file: complaint(file, force, list(inputs)), option) as found:
        yield found


@contextmanager
def folder(out: Path | None, default: Path, *, force: bool = False, option: str = "-o") -> Iterator[Path]:
    """The folder to write into, under the same rules: it is taken if there is something in it."""
    path = out or default
    check_folder(path, option)

    def taken(path: Path) -> str | None:
        full = any(path.iterdir()) if path.is_dir() else path.exists()
        return "it exists, and is not empty. Take another, or --force." if full and not force else None

    candidates = ([path.with_name(f"{path.name}{n}") if n else path] for n in numbers())
    with first_free(candidates, out is not None, taken, option) as found:
        yield found[0]


@contextmanager
def first_free(
    candidates: Iterable[list[Path]], named: bool, complaint: Callable[[Path], str | None], option: str
) -> Iterator[list[Path]]:
    """The first candidates that nobody complains of, locked; if they were named, the first ones must do."""
    for paths in candidates:
        with ExitStack() as stack:
            try:
                for path in paths:
                    stack.enter_context(locked(path))
                    if (reason := complaint(path)) is not None:
                        raise TakenError(f"{option} {path}: {reason}")
            except TakenError:
                if named:
                    raise
                continue
            locks = stack.pop_all()
        with locks:
            yield paths
            return


def numbers() -> Iterator[str]:
    """What tells names apart: nothing, -2, -3 and so on."""
    return (f"-{n}" if n > 1 else "" for n in count(1))


def complaint(file: Path, force: bool, inputs: list[Path | str | None]) -> str | None:
    """Why a file must not be written; None if it may."""
    if not file.exists():
        return None
    if any(is_input(file, one) for one in inputs if one is not None):
        return "it is an input of this command."
    return None if force and file.is_file() else "it exists. Take another name, or --force to overwrite it."


def is_input(file: Path, one: Path | str) -> bool:
    """Whether a file is an input, or is named in one, in what that includes, or in an option."""
    waiting = [one] if isinstance(one, Path) else [Path(word) for word in re.split("[\"'=]", one)]
    seen: set[str] = set()
    while waiting:
        given = waiting.pop()
        real = os.path.realpath(given) if os.path.isfile(given) else ""
        if not real or real in seen:
            continue
        if os.path.samefile(real, file):
            return True
        seen.add(real)
        if given.suffix.lower() in DESCRIPTIONS:
            words = re.findall("[\"']([^\"']+)[\"']", given.read_text(errors="replace"))
            beside = ((given.parent / word, Path(word)) for word in words)
            waiting += [near if os.path.isfile(near) else far for near, far in beside]
    return False


def write(path: Path, image: np.ndarray, names: list[str]) -> None:
    """Write an image (height, width, channels) of linear radiance: to EXR as it is, to PNG in sRGB, clipped at 1.

    ``names`` are those of the channels: colours first, then perhaps others (AOVs), for which PNG has no place.
    """
    import mitsuba as mi
    import numpy as np

    image = image.astype(np.float32)
    with atomically(path) as part:
        if path.suffix.lower() == ".exr":
            bitmap = mi.Bitmap(image, mi.Bitmap.PixelFormat.MultiChannel, names)
        else:
            bitmap = channels.png(image, names)
        bitmap.write(str(part))
