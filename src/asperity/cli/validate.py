"""``asperity validate``."""

from __future__ import annotations

import time
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table
from rich.text import Text

from asperity import __version__
from asperity.errors import UnknownNameError

from . import console, output, passes, variants

QUICK, FULL = (4e5, 16), (4e6, 32)
"""Paths per direction, and tiles."""
VERDICT = {True: ("passed", "green"), False: ("failed", "bold red"), None: ("", "dim")}


def validate(
    ctx: typer.Context,
    model: Annotated[str, typer.Argument(metavar="MODEL", help="A model that `asperity list` shows.")],
    quick: Annotated[bool, typer.Option("--quick", help="A tenth of the paths.")] = False,
    seed: Annotated[int, typer.Option(min=0, help="Another seed, other tiles.")] = 0,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Folder for the report.")] = None,
    variant: variants.Variant = None,
    force: output.Force = False,
) -> None:
    """Compare a model with light traced through its microgeometry; write a report. The exit code is 1 if it fails.

    Ctrl-C stops, and keeps the sections that are done.
    """
    with console.status("loading"):
        variants.choose(variant)
        from asperity.validation import PAPERS, report

    if model not in PAPERS:
        raise UnknownNameError("model with a validation", model, PAPERS)
    folder = ctx.with_resource(output.folder(out, Path(f"asperity-validate-{model}"), force=force))
    folder.mkdir(exist_ok=True)  # now, not after minutes of tracing
    start, interrupted = time.perf_counter(), ctx.with_resource(passes.interruptible())
    paths, tiles = QUICK if quick else FULL
    found: list[Any] = []

    def write(early: str, new: int = 0) -> Path:
        """Write what there is; only the last sections, if they are ``new``, have pictures that are not there yet."""
        preface = (
            f"{early}Made by `asperity validate {model}{' --quick' if quick else ''}`, asperity {__version__}, in "
            f"{time.perf_counter() - start:.0f} s: {paths:g} paths per direction (some sections take a quarter or "
            f"eight times that) in {tiles} groups, seed {seed}. Each group has a tile of its own, where the surface is "
            "random. Errors are standard errors over the groups. The bounds are such that a right model fails a report "
            "with a probability of 1 %."
        )
        return report.write(f"`{model}` against its microgeometry", preface, found, folder, len(found) - new)

    def tick(*_: Any) -> None:
        if interrupted:
            raise StoppedError

    with console.status("measuring") as status, suppress(StoppedError):
        for section in PAPERS[model](report.Effort(paths, tiles, seed, tick)):
            found.append(section)
            write("Not finished. ", new=1)
            status.update(f"measured: {section.title}")
            console.log(f"measured: {section.title}")
            tick()
    early = "Stopped early. " if interrupted else ""
    path = write(early)
    console.stdout().print(tabulated(found))
    typer.echo(f"{early}{path}: {time.perf_counter() - start:.0f} s")
    raise typer.Exit(0 if report.passed(found) and not interrupted else 1)


class StoppedError(Exception):
    """Somebody wants to stop; what is being measured is left out."""


def tabulated(sections: list[Any]) -> Table:
    """The findings."""
    table = Table("section", "claim", "measured", "bound", "")
    for section in sections:
        for n, finding in enumerate(section.findings):
            verdict, style = VERDICT[finding.passed]
            row = (section.title if n == 0 else "", finding.claim, finding.measured, finding.bound)
            table.add_row(*row, Text(verdict, style))
    return table
