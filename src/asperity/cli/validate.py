"""``asperity validate``."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table
from rich.text import Text

from asperity import __version__
from asperity.errors import UnknownNameError

from . import console, passes, variants

QUICK, FULL = (4e5, 16), (4e6, 32)
"""Paths per direction, and tiles."""
VERDICT = {True: ("passed", "green"), False: ("failed", "bold red"), None: ("", "dim")}


def validate(
    model: Annotated[str, typer.Argument(metavar="MODEL", help="A model that `asperity list` shows.")],
    quick: Annotated[bool, typer.Option("--quick", help="A tenth of the paths.")] = False,
    seed: Annotated[int, typer.Option(min=0, help="Another seed, other tiles.")] = 0,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Folder for the report.")] = None,
    variant: variants.Variant = None,
) -> None:
    """Compare a model with light traced through its microgeometry; write a report. The exit code is 1 if it fails."""
    with console.status("loading"):
        variants.choose(variant)
        from asperity.validation import PAPERS, report

    if model not in PAPERS:
        raise UnknownNameError("model with a validation", model, PAPERS)
    folder = out or Path(f"asperity-validate-{model}")
    folder.mkdir(parents=True, exist_ok=True)  # now, not after minutes of tracing
    start = time.perf_counter()
    paths, tiles = QUICK if quick else FULL
    table, found = Table("section", "claim", "measured", "bound", ""), []
    with console.status("measuring") as status, passes.interruptible() as interrupted:
        for section in PAPERS[model](report.Effort(paths, tiles, seed)):
            found.append(section)
            status.update(f"measured: {section.title}")
            for n, finding in enumerate(section.findings):
                verdict, style = VERDICT[finding.passed]
                row = (section.title if n == 0 else "", finding.claim, finding.measured, finding.bound)
                table.add_row(*row, Text(verdict, style))
            if interrupted:
                break
    early = "Stopped early. " if interrupted else ""
    seconds = time.perf_counter() - start
    preface = (
        f"{early}Made by `asperity validate {model}{' --quick' if quick else ''}`, asperity {__version__}, in "
        f"{seconds:.0f} s: {paths:g} paths per direction (some sections take a quarter or eight times that) in {tiles} "
        f"groups, seed {seed}. Each group has a tile of its own, where the surface is random. Errors are standard "
        "errors over the groups. The bounds are such that a right model fails a report with a probability of 1 %."
    )
    path = report.write(f"`{model}` against its microgeometry", preface, found, folder)
    console.stdout().print(table)
    typer.echo(f"{early}{path}: {seconds:.0f} s")
    raise typer.Exit(0 if report.passed(found) and not interrupted else 1)
