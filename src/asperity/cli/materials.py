"""The options ``--preset``, ``--material`` and ``--set``, and the material that they name."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from asperity.errors import ParameterError
from asperity.materials import Material, resolve
from asperity.scenes import presets

PresetName = Annotated[str | None, typer.Option("--preset", help="A preset that `asperity list` shows.")]
MaterialFile = Annotated[Path | None, typer.Option("--material", help="A JSON file that describes a BSDF.")]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="Change a parameter: tau_0=0.4, base.alpha=0.1. Repeatable."),
]


def chosen(preset: str | None, file: Path | None, settings: list[str] | None) -> Material:
    """The preset or file, the default preset if nothing is chosen, with the settings."""
    if preset is not None and file is not None:
        raise ParameterError("--preset and --material exclude each other.")
    return resolve(preset or presets.DEFAULT if file is None else file, settings or [])
