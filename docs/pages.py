"""Pages that the package writes about itself when the site is built: presets, commands, BibTeX.

They lie in `docs/generated/`, which git ignores: what they say stands in the code, once.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from itertools import groupby
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
FOLDER = "generated"
THUMBNAILS = DOCS / "pictures" / "gallery"
OTHERS = "Mitsuba's own"
"""Presets without a model of ours, to compare with."""


def gallery() -> str:
    """All presets, by model: thumbnail, what it is, its command, its description."""
    from asperity.models import MODELS
    from asperity.scenes import presets

    order = [*MODELS, OTHERS]
    found = sorted((presets.load(name) for name in presets.names()), key=lambda preset: order.index(model_of(preset)))
    parts = [
        "# Gallery",
        f"The {len(found)} presets, by the model that makes them. `asperity list` prints them, `asperity show NAME` "
        "shows one, and `asperity show NAME --json > my.json` begins a material of your own. A picture leads to "
        "its description.",
    ]
    for model, group in groupby(found, model_of):
        members = list(group)
        parts += [
            f"## {f'`{model}`' if model in MODELS else model}",
            ":::{container} gallery",
            *map(thumbnail, members),
            ":::",
        ]
        parts += map(entry, members)
    return "\n\n".join(parts)


def model_of(preset: Any) -> str:
    """The plugin that a preset is an example of: the first of ours in it, or else the BSDF itself."""
    from asperity.models import MODELS

    def types(node: Any) -> list[str]:
        inner = [name for value in node.values() if isinstance(value, dict) for name in types(value)]
        return [node.get("type", ""), *inner]

    return next((name for name in types(preset.material) if name in MODELS), OTHERS)


def thumbnail(preset: Any) -> str:
    """A preset's picture with its name below, a link to its entry; the name alone where there is no picture."""
    return f"[{picture(preset)} {preset.name}](#preset-{preset.name})"


def picture(preset: Any) -> str:
    """The thumbnail of a preset, if it was made."""
    found = sorted(THUMBNAILS.glob(f"{preset.name}.*"))
    return f"![{preset.title}](../{found[0].relative_to(DOCS).as_posix()})" if found else ""


def entry(preset: Any) -> str:
    """What a preset is, how to render it, and the file that describes it."""
    from asperity.scenes import presets

    material = json.loads((presets.FOLDER / f"{preset.name}.json").read_text())["material"]
    shown = picture(preset)
    return "\n".join(
        [
            f"(preset-{preset.name})=",
            f"### {preset.title}",
            "",
            f":::{{container}} preset\n{shown}\n:::\n" if shown else "",
            f"{preset.about} *{preset.source}.*",
            "",
            f"```sh\nasperity render --preset {preset.name}\n```",
            "",
            f"<details><summary>{preset.name}.json</summary>",
            "",
            f"```json\n{json.dumps(material, indent=2)}\n```",
            "",
            "</details>",
        ]
    )


def commands() -> str:
    """All commands, with their arguments and options."""
    import typer.main

    from asperity.cli import app

    root: Any = typer.main.get_command(app)
    parts = [
        "# The command line",
        "What `asperity --help`, and `asperity COMMAND --help`, say. Before the name of a command may stand:",
        table(root.params),
    ]
    for name, command in root.commands.items():
        words = [word(argument) for argument in command.params if argument.param_type_name == "argument"]
        usage = " ".join(["asperity", name, "[OPTIONS]", *words])
        parts += [f"## {name}", f"```\n{usage}\n```", prose(command.help), table(command.params)]
    return "\n\n".join(parts)


def word(argument: Any) -> str:
    """An argument as it stands in a line of usage."""
    name = called(argument) if argument.required else f"[{called(argument)}]"
    return name if argument.nargs == 1 else f"{name}..."


def called(argument: Any) -> str:
    """An argument's name, without the brackets and dots that some have in it."""
    return (argument.metavar or argument.name.upper()).strip("[].")


def table(parameters: list[Any]) -> str:
    """Arguments and options of a command."""
    rows = [row(one) for one in parameters if not one.hidden and one.name != "help"]
    return "\n".join(["| | default | |", "|---|---|---|", *rows]) if rows else ""


def row(parameter: Any) -> str:
    """One of them."""
    if parameter.param_type_name == "argument":
        name = f"`{called(parameter)}`"
    else:
        value = "" if parameter.is_flag else f" {parameter.metavar or parameter.name.strip('_').upper()}"
        name = ", ".join(f"`{option}{value}`" for option in [*parameter.opts, *parameter.secondary_opts])
    default = parameter.default
    shown = "" if default is None or default is False or callable(default) or default in ([], ()) else f"`{default}`"
    return f"| {name} | {shown} | {prose(parameter.help).replace('|', chr(92) + '|')} |"


def prose(text: str | None) -> str:
    """Help as Markdown: two blanks or more begin what is laid out, and stays so."""
    from textwrap import dedent

    return dedent(text or "").replace("\b", "").strip().replace("*", r"\*").replace("<", r"\<")


def bibliography() -> str:
    """BibTeX of all papers that are implemented, as `asperity cite` prints it."""
    from asperity.models import MODELS

    return "\n\n".join(dict.fromkeys(model.citation for model in MODELS.values())) + "\n"


PAGES: dict[str, Callable[[], str]] = {
    "gallery.md": gallery,
    "commands.md": commands,
    "models.bib": bibliography,
}


def write(folder: Path) -> None:
    """Write what changed of them, so that Sphinx builds that anew and no more."""
    folder.mkdir(exist_ok=True)
    for name, page in PAGES.items():
        path, text = folder / name, page()
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
