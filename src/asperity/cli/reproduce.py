"""``asperity reproduce``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table
from rich.text import Text

from asperity.errors import ParameterError
from asperity.files import locked

from . import console, output, passes, validate, variants


def reproduce(
    ctx: typer.Context,
    papers: Annotated[
        list[str] | None, typer.Argument(metavar="[PAPER]...", help="Models, or first authors; all if there are none.")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="A tenth of the paths.")] = False,
    only: Annotated[list[str] | None, typer.Option("--only", metavar="LABEL", help='As "Fig. 7"; repeatable.')] = None,
    seed: Annotated[int, typer.Option(min=0, help="Another seed, other tiles.")] = 0,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for the pages.")] = Path("reproduction"),
    variant: variants.Variant = None,
    force: Annotated[bool, typer.Option("--force", help="Make anew what other code or another effort made.")] = False,
) -> None:
    """Make the papers' figures and tables anew: a page a paper. The exit code is 1 if a claim fails.

    What is there already is not made again: Ctrl-C stops, and the same command goes on from there.
    """
    with console.status("loading"):
        output.check_folder(out, "-o")
        variants.choose(variant)
        from asperity import reproduce as reproduction

        chosen = [reproduction.find(name) for name in papers or reproduction.PAPERS]
        if only and len(chosen) != 1:
            raise typer.BadParameter("takes one paper.", param_hint="--only")
        total = sum(len(paper.needed(only or ())) for paper in chosen)
    if out.exists() and not out.is_dir():
        raise ParameterError(f"-o {out}: it is a file. Name a folder.")
    out.mkdir(exist_ok=True)
    ctx.with_resource(locked(out))
    interrupted = ctx.with_resource(passes.interruptible())
    made = []
    with console.progress("sections") as progress:
        task, count = progress.add_task("", total=total), 0
        for paper in chosen:

            def tell(section: str, found: Any, model: str = paper.model) -> None:
                nonlocal count
                count += found is not None
                progress.update(task, completed=count, description=f"{model}: {section}")
                if found is not None:
                    console.log(f"{model}: {found.section.title}, {found.seconds:.0f} s")

            options: dict[str, Any] = {"quick": quick, "seed": seed, "only": only or (), "force": force}
            made.append(reproduction.reproduce(paper.model, out, **options, stop=lambda: bool(interrupted), done=tell))
    typer.echo(f"{reproduction.write_index(out)}")
    console.stdout().print(tabulated(made))
    raise typer.Exit(0 if all(one.passed for one in made) else 1)


def tabulated(made: list[Any]) -> Table:
    """What became of each paper, and the findings that failed."""
    table = Table("paper", "claim", "measured", "bound", "")
    for one in made:
        findings = [finding for kept in one.sections.values() for finding in kept.section.findings]
        held = sum(finding.passed is True for finding in findings)
        seconds = sum(kept.seconds for kept in one.sections.values())
        verdict, style = ("stopped early", "bold red") if one.missing else validate.VERDICT[one.passed]
        table.add_row(one.paper.model, f"{held} hold", f"{seconds:.0f} s", "", Text(verdict, style))
        for finding in findings:
            if finding.passed is False:
                verdict, style = validate.VERDICT[False]
                table.add_row("", finding.claim, finding.measured, finding.bound, Text(verdict, style))
    return table
