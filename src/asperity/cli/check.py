"""``asperity check``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table
from rich.text import Text

from asperity.errors import ParameterError
from asperity.files import atomically
from asperity.materials import resolve

from . import console, materials, output, variants

VERDICT = {True: ("passed", "green"), False: ("failed", "bold red"), None: ("skipped", "dim")}


def check(
    target: Annotated[
        str | None, typer.Argument(metavar="MATERIAL", help="A preset, a BSDF (ours, Mitsuba's, yours), a file, JSON.")
    ] = None,
    settings: materials.Settings = None,
    preset: materials.PresetName = None,
    material: materials.MaterialFile = None,
    pictures: Annotated[Path, typer.Option(help="Folder for pictures of what failed.")] = Path("asperity-check"),
    only: Annotated[list[str] | None, typer.Option(help="A check to run instead of all; repeatable.")] = None,
    plugins: Annotated[
        list[Path] | None,
        typer.Option("--import", metavar="FILE.py", help="A file that registers plugins of yours; repeatable."),
    ] = None,
    variant: variants.Variant = None,
) -> None:
    """Check a BSDF: sampling, reciprocity, energy, gradients and more. The exit code is 1 if a check fails."""
    if sum(way is not None for way in (target, preset, material)) != 1:
        raise ParameterError("give one of: a material, --preset, --material.")
    if pictures.exists() and not pictures.is_dir():
        raise ParameterError(f"--pictures {pictures}: it is a file. Name a folder.")
    with console.status("loading"):
        from asperity.lab import checks
        from asperity.lab import plugins as own

        for path in plugins or []:
            own.load(path)
        variants.choose(variant)
        chosen = resolve(target or preset or material, settings or [])
        bsdf = chosen.load()

    names = [checks.canonical(check) for check in only or checks.NAMES]
    with console.progress("checks") as progress:
        task = progress.add_task("", total=len(names))
        results = checks.check(
            chosen.description or bsdf,
            lambda name, done, _: progress.update(task, description=name, completed=done),
            names,
        )
    report(results)
    failures = [result for result in results if result.passed is False]
    write_pictures(failures, chosen.name, pictures)
    raise typer.Exit(1 if failures else 0)


def report(results: list[Any]) -> None:
    """Print the table."""
    table = Table("check", "verdict", "measured", "bound")
    for result in results:
        verdict, style = VERDICT[result.passed]
        table.add_row(result.name, Text(verdict, style), result.measured, result.bound)
    console.stdout().print(table)


def write_pictures(failures: list[Any], name: str, folder: Path) -> None:
    """Write a picture of each failure that measured something, and print where."""
    from asperity.lab import pictures

    for result in failures:
        if result.evidence is not None:
            folder.mkdir(parents=True, exist_ok=True)
            with output.files(folder, Path(f"{name}-{result.name}.png"), (".png",)) as [path], atomically(path) as part:
                pictures.write(result, part)
            typer.echo(path)
