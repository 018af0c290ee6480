"""``asperity validate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table
from rich.text import Text

from . import console, output, passes, variants

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
        from asperity import validation

        validation.paper(model)
    folder = ctx.with_resource(output.folder(out, Path(f"asperity-validate-{model}"), force=force))
    interrupted = ctx.with_resource(passes.interruptible())
    with console.status("measuring") as status:

        def tell(section: Any) -> None:
            status.update(f"measured: {section.title}")
            console.log(f"measured: {section.title}")

        report = validation.validate(model, folder, quick=quick, seed=seed, stop=lambda: bool(interrupted), done=tell)
    console.stdout().print(tabulated(report.sections))
    typer.echo(f"{'' if report.finished else 'Stopped early. '}{report.path}: {report.seconds:.0f} s")
    raise typer.Exit(0 if report.passed else 1)


def tabulated(sections: list[Any]) -> Table:
    """The findings."""
    table = Table("section", "claim", "measured", "bound", "")
    for section in sections:
        for n, finding in enumerate(section.findings):
            verdict, style = VERDICT[finding.passed]
            row = (section.title if n == 0 else "", finding.claim, finding.measured, finding.bound)
            table.add_row(*row, Text(verdict, style))
    return table
