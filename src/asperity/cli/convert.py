"""``asperity convert``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from . import console, materials, output, plot, variants

if TYPE_CHECKING:
    from asperity.measured.conversion import Converted

FORMATS = (".bsdf", ".binary", ".csv", ".npz")


def convert(
    ctx: typer.Context,
    given: Annotated[
        str,
        typer.Argument(metavar="MATERIAL", help="A preset, a BSDF, JSON, a file; measured: .binary .bsdf .csv .npz."),
    ],
    out: Annotated[Path, typer.Argument(metavar="OUTPUT", help="Its ending: .binary, .bsdf, .csv or .npz.")],
    settings: materials.Settings = None,
    resolution: Annotated[
        int | None, typer.Option("--resolution", help="Steps of the half vector's angle, 0 to 90 degrees.")
    ] = None,
    wavelengths: Annotated[
        Any, typer.Option(parser=plot.numbers("--wavelengths"), metavar="NM,...", help="Tabulate a model at these.")
    ] = None,
    columns: Annotated[
        list[str] | None,
        typer.Option("--column", metavar="NAME=COLUMN", help="What a CSV calls theta_i, phi_o, value. Repeatable."),
    ] = None,
    variant: variants.Variant = None,
    force: output.Force = False,
) -> None:
    """Convert a measured BRDF, or any material, to a file for Mitsuba, pbrt, Falcor or BRDF viewers.

    It says how far what is read from the file is from what was converted.
    """
    inputs = [given if plot.is_text(given) else Path(given), *(settings or [])]
    [path] = ctx.with_resource(output.files(out, out, FORMATS, force=force, inputs=inputs))
    with console.status("reading"):
        variants.choose(variant)
        import asperity
        from asperity import measured

        named = dict(column.partition("=")[::2] for column in columns or [])
        material = asperity.material(measured.load(given, columns=named) if named else given, settings or [])
    with console.progress("steps") as progress:
        task = progress.add_task("converting", total=1)

        def told(name: str, done: int, total: int) -> None:
            progress.update(task, completed=done, total=total, description=name)

        found = asperity.convert(material, path, resolution=resolution, wavelengths=wavelengths, progress=told)
    console.stdout().print(report(found))
    typer.echo(path)


def report(found: Converted) -> Table:
    """How far off the file is."""
    table = Table("what is read, against what was converted", "median", "95%", "worst")
    table.add_row("relative error", *(f"{error:.2%}" for error in found.relative))
    table.add_row("ln(1 + f cos)", *(f"{error:.2g}" for error in found.log_cosine))
    if found.scattered is not None:
        table.add_row("measured pairs from the others, relative", *(f"{error:.2%}" for error in found.scattered))
    return table
