"""The ``asperity`` command: one file a command. Mitsuba is imported by the commands that need it, when they run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import typer

from asperity import __version__

from . import bench, check, cite, compare, doctor, fit, list, measure, merge, plot, render, reproduce, show, validate
from .errors import OneLineErrors

COMMANDS: dict[str, Callable[..., None]] = {
    "render": render.render,
    "list": list.list_all,
    "show": show.show,
    "cite": cite.cite,
    "check": check.check,
    "measure": measure.measure,
    "plot": plot.plot,
    "compare": compare.compare,
    "fit": fit.fit,
    "merge": merge.merge,
    "validate": validate.validate,
    "reproduce": reproduce.reproduce,
    "bench": bench.bench,
    "doctor": doctor.doctor,
}
"""In the order of the help."""

app = typer.Typer(
    cls=OneLineErrors,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for name, command in COMMANDS.items():
    app.command(name)(command)


def version(wanted: bool) -> None:
    """Print the version and leave."""
    if wanted:
        typer.echo(f"asperity {__version__}")
        raise typer.Exit


@app.callback()
def main(
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")] = False,
    version: Annotated[bool, typer.Option("--version", callback=version, is_eager=True, help="Print it.")] = False,
) -> None:
    """Materials from explicit microgeometry: render, inspect and check them.

    `asperity render` makes a first picture; `asperity doctor` says what is wrong if it does not.
    """
