"""The material that the options ``--preset``, ``--material`` and ``--set`` describe."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Annotated, Any

import typer

from asperity.errors import ParameterError, suggestion
from asperity.scenes import presets

PresetName = Annotated[str | None, typer.Option("--preset", help="A preset that `asperity list` shows.")]
MaterialFile = Annotated[Path | None, typer.Option("--material", help="A JSON file that describes a BSDF.")]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="Change a parameter: tau_0=0.4, base.alpha=0.1. Repeatable."),
]


def chosen(preset: str | None, file: Path | None, settings: list[str] | None) -> presets.Preset:
    """The preset, the default one if nothing is chosen, with the settings."""
    if preset is not None and file is not None:
        raise ParameterError("--preset and --material exclude each other.")
    found = presets.load(preset or presets.DEFAULT) if file is None else presets.read(file)
    apply(found.material, settings or [])
    return found


def apply(material: dict[str, Any], settings: list[str]) -> None:
    """Change the description, in place. Whether the parameter exists is for the plugin to say."""
    for setting in settings:
        path, equals, text = setting.partition("=")
        *parents, name = path.split(".")
        if not (equals and name):
            raise ParameterError(f"--set {setting}: expected NAME=VALUE, such as tau_0=0.4.")
        node = material
        for parent in parents:
            parts = [key for key, value in node.items() if isinstance(value, dict)]
            if parent not in parts:
                raise ParameterError(f"--set {setting}: nothing is nested as {parent!r}. {suggestion(parent, parts)}")
            node = node[parent]
        node[name] = value(text)


def value(text: str) -> Any:
    """JSON, or else a word; three numbers are a colour, and numbers may begin or end with their point."""
    try:
        parsed = json.loads(text)
    except json.JSONDecodeError:
        return float(text) if re.fullmatch(r"[+-]?(\d+\.|\.?\d)\d*(e[+-]?\d+)?", text, re.IGNORECASE) else text
    colour = isinstance(parsed, list) and len(parsed) == 3 and all(isinstance(x, int | float) for x in parsed)
    return {"type": "rgb", "value": parsed} if colour else parsed


def check_material(material: dict[str, Any]) -> None:
    """Let the plugins check the description of a BSDF, before anything slow begins; needs a variant."""
    import mitsuba as mi

    from asperity import loading

    if not isinstance(loading.load(material), mi.BSDF):
        raise ParameterError(f"{material['type']!r} is not a material.")
