"""``asperity merge``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from . import console, output
from .measure import FORMATS, report


def merge(
    ctx: typer.Context,
    files: Annotated[list[Path], typer.Argument(metavar="NPZ...", help="Measurements of the same, with other seeds.")],
    out: Annotated[Path | None, typer.Option("--out", "-o", help="NPZ; merged.npz if left out.")] = None,
    force: output.Force = False,
) -> None:
    """Merge measurements of the same microgeometry with different seeds into one, exactly."""
    [out] = ctx.with_resource(output.files(out, Path("merged.npz"), FORMATS, force=force, inputs=files))
    with console.status("loading"):
        from asperity import goniophotometer

        merged = goniophotometer.merge([goniophotometer.Measurement.load(file) for file in files])
        merged.save(out)
    report(merged)
    typer.echo(f"{out}: {merged.total_paths:.3g} paths, {len(merged.labels)} tiles")
    typer.echo(f"Try next: asperity plot {out}")
