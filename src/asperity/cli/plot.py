"""``asperity plot``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from asperity.files import atomically

from . import console, output, variants

FORMATS = (".png", ".pdf", ".svg")


def plot(
    ctx: typer.Context,
    file: Annotated[Path, typer.Argument(metavar="NPZ", help="What `asperity measure` wrote.")],
    out: Annotated[Path | None, typer.Option("--out", "-o", help="PNG, PDF or SVG; FILE.png if left out.")] = None,
    model: Annotated[bool, typer.Option(help="Draw the model's own values as well, if it is a model's.")] = True,
    force: output.Force = False,
) -> None:
    """Plot a measurement: maps, their errors, slices through the plane of incidence, and the albedo."""
    [out] = ctx.with_resource(output.files(out, file.parent / f"{file.stem or output.NAME}.png", FORMATS, force=force))
    with console.status("drawing"):
        from asperity.goniophotometer import Measurement, plots

        measured = Measurement.load(file)
        description = measured.about.get("model") if model else None
        if description is not None:
            variants.choose(None if measured.mode == "rgb" else f"llvm_ad_{measured.mode}")
        figure = plots.figure(measured, description)
        with atomically(out) as part:
            figure.savefig(part)
    typer.echo(out)
