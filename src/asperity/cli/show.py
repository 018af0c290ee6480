"""``asperity show``."""

from __future__ import annotations

import json
from typing import Annotated

import typer
from rich.table import Table

from . import console, registry

Name = Annotated[str, typer.Argument(metavar="NAME", help="What `asperity list` shows: a model, a preset.")]


def show(name: Name) -> None:
    """Show what a model is and its parameters, or what a preset is made of."""
    from asperity.scenes import presets

    out = console.stdout()
    if name in presets.names():
        preset = presets.load(name)
        out.print(f"{preset.title} ({preset.source}). {preset.about}\n")
        typer.echo(json.dumps(preset.material, indent=2, default=str))
        return
    found = registry.described(name)
    out.print(f"{name}: {registry.about(found)}\n")
    table = Table("parameter", "kind", "default", "allowed", "unit", "meaning")
    for row in found.rows():
        table.add_row(*row)
    table.columns[0].no_wrap = True
    out.print(table)
