"""``asperity show``."""

from __future__ import annotations

import json
from typing import Annotated, Any

import typer
from rich.table import Table

from asperity.errors import ParameterError

from . import console, registry

Name = Annotated[str, typer.Argument(metavar="NAME", help="What `asperity list` shows: a model, a preset.")]


def show(
    name: Name,
    as_json: Annotated[
        bool, typer.Option("--json", help="Of a preset, print only what a file for --material holds.")
    ] = False,
) -> None:
    """Show what a model is and its parameters, or what a preset is made of.

    `asperity show gilded --json > my.json` begins a material of one's own: `asperity render --material my.json`.
    """
    from asperity.scenes import presets

    out = console.stdout()
    if name in presets.names():
        preset = presets.load(name)
        if as_json:
            typer.echo(text_of({key: value for key, value in preset._asdict().items() if key != "name"}))
        else:
            out.print(f"{preset.title} ({preset.source}). {preset.about}\n")
            typer.echo(text_of(preset.material))
        return
    found = registry.described(name)
    if as_json:
        raise ParameterError(f'--json: {name} is no preset. For `--material`, write {{"type": "{name}", ...}}.')
    out.print(f"{name}: {registry.about(found)}\n")
    table = Table("parameter", "kind", "default", "allowed", "usual", "unit", "meaning")
    for row in found.rows():
        table.add_row(*row)
    table.columns[0].no_wrap = True
    out.print(table)


def text_of(content: dict[str, Any]) -> str:
    """JSON that `presets.read` reads; a matrix as its rows."""
    return json.dumps(content, indent=2, default=lambda matrix: [[float(x) for x in row] for row in matrix])
