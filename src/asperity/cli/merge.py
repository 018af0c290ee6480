"""``asperity merge``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from . import console
from .measure import FORMATS, report
from .output import writable


def merge(
    files: Annotated[list[Path], typer.Argument(metavar="NPZ...", help="Measurements of the same, with other seeds.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="NPZ.")] = Path("merged.npz"),
) -> None:
    """Merge measurements of the same microgeometry with different seeds into one, exactly."""
    out = writable(out, FORMATS)
    with console.status("loading"):
        from asperity import goniophotometer

        merged = goniophotometer.merge([goniophotometer.Measurement.load(file) for file in files])
        merged.save(out)
    report(merged)
    typer.echo(f"{out}: {merged.total_paths:.3g} paths, {len(merged.labels)} tiles")
    typer.echo(f"Try next: asperity plot {out}")
