"""``asperity show``."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.table import Table

from . import console, registry


def show(model: Annotated[str, typer.Argument(metavar="MODEL", help="A name that `asperity list` shows.")]) -> None:
    """Show what a model is, and its parameters."""
    found = registry.model(model)
    out = console.stdout()
    out.print(f"{model}: {registry.about(found)}\n")
    table = Table("parameter", "kind", "default", "allowed", "unit", "meaning")
    for row in found.rows():
        table.add_row(*row)
    table.columns[0].no_wrap = True
    out.print(table)
