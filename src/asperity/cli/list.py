"""``asperity list``."""

from __future__ import annotations

import re

from rich.table import Table

from . import console
from .registry import about, models


def list_all() -> None:
    """List the models, and the presets that show them."""
    from asperity.models import PHASES, TEXTURES
    from asperity.scenes import presets

    out = console.stdout()
    table = Table("model", "what it models", "source")
    for name, model in models().items():
        table.add_row(name, about(model).split("\n\n")[0], " ".join(re.findall(r"doi\s*=\s*\{(.*?)\}", model.citation)))
    for kind, plugins in (("a texture", TEXTURES), ("a phase function", PHASES)):
        for name, plugin in plugins.items():
            table.add_row(name, about(plugin).split("\n\n")[0], kind)
    out.print(table)

    table = Table("preset", "title", "source")
    for preset in map(presets.load, presets.names()):
        table.add_row(preset.name, preset.title, preset.source)
    out.print(table)
