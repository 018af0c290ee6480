"""Many pictures of one command: all presets, or an object that turns."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

import typer

from asperity.errors import ParameterError
from asperity.files import atomically
from asperity.materials import Material, resolve

from . import channels, output, pictures

SHEET = "contact-sheet.png"
Jobs = dict[str, tuple[Material, dict[str, Any]]]
"""A material and how to look at it, by the name of the picture."""


def every(view: dict[str, Any]) -> Jobs:
    """All presets; ``view`` overrides theirs."""
    from asperity.scenes import presets

    found = {name: resolve(name) for name in presets.names()}
    return {name: (one, one.preview | view) for name, one in found.items()}


def turning(material: Material, view: dict[str, Any], frames: int) -> Jobs:
    """The frames of a full turn, by their numbers from 1."""
    turns = {f"{n + 1:0{len(str(frames))}}": 360 * n / frames for n in range(frames)}
    return {name: (material, material.preview | view | {"turn": turn}) for name, turn in turns.items()}


def write(
    jobs: Jobs,
    folder: Path,
    paint: Callable[[Material, dict[str, Any]], tuple[pictures.Picture, bool]],
    *,
    again: bool,
    sheet: bool,
    interrupted: Collection[Any],
) -> bool:
    """Write NAME.png for each job, and perhaps a sheet of them; whether all are there, and all pixels sound.

    Pictures that are there are kept, unless they are to be made ``again``. After an interruption the whole ones stay;
    ``paint`` says whether a picture is whole.
    """
    try:
        folder.mkdir(exist_ok=True)
    except FileExistsError:
        raise ParameterError(f"-o {folder}: it is a file, not a folder.") from None
    files, sound = {name: folder / f"{name}.png" for name in jobs}, True
    for n, (name, job) in enumerate(jobs.items(), 1):
        if files[name].exists() and not again:
            continue
        start = time.perf_counter()
        picture, whole = paint(*job)
        if whole:
            output.write(files[name], picture.shown, picture.names)
            typer.echo(f"{n}/{len(jobs)} {files[name]}: {time.perf_counter() - start:.1f} s")
            if fault := channels.fault(picture.image):
                typer.echo(f"warning: {name}: {fault}", err=True)
                sound = False
        if interrupted:
            typer.echo(f"stopped early: {sum(file.exists() for file in files.values())} of {len(jobs)} pictures")
            return False
    if sheet:
        from asperity.scenes.sheet import arranged

        with atomically(folder / SHEET) as part:
            arranged(files).save(part)
        typer.echo(f"{folder / SHEET}: {len(files)} pictures")
    return sound
