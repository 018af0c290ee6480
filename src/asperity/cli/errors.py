"""The one place where an error becomes a line on stderr and an exit code."""

from __future__ import annotations

import codecs
import io
import re
import sys
import unicodedata
from typing import Any

import typer
from typer.core import TyperGroup

from asperity.errors import AsperityError

FAULTS = (AsperityError, RuntimeError, ImportError, OSError, MemoryError)
"""Of what was asked for, or of the machine. Mitsuba knows only RuntimeError, and ImportError for variants."""


class OneLineErrors(TyperGroup):
    """Prints faults as one line, without a traceback; anything else is a bug of ours, and keeps its own."""

    def main(self, *args: Any, **options: Any) -> Any:
        """Begin, whatever the terminal is."""
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors="spelt")
        return super().main(*args, **options)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Let ``--debug`` stand anywhere: it is what one adds at the end of the command that just failed."""
        if "--debug" in args:
            args = ["--debug", *(arg for arg in args if arg != "--debug")]
        return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        try:
            return super().invoke(ctx)
        except (typer.Exit, typer.Abort, BrokenPipeError):  # RuntimeErrors and an OSError that are no faults
            raise
        except FAULTS as error:
            if ctx.params["debug"]:
                raise
            from asperity.loading import one_line  # here, for the sake of `asperity --help`

            cause: BaseException = error
            while "(see above)" in str(cause) and cause.__cause__:  # Dr.Jit, of the error before
                cause = cause.__cause__
            typer.echo(f"{typer.style('error:', fg='red')} {one_line(str(cause)) or 'out of memory'}", err=True)
            raise typer.Exit(2) from error


def spelt(error: UnicodeError) -> tuple[str, int]:
    """What to print where a terminal has no θ, such as one of cp1252: theta; or a question mark."""
    assert isinstance(error, UnicodeEncodeError)
    names = (unicodedata.name(letter, "") for letter in error.object[error.start : error.end])
    greek = (re.fullmatch("GREEK SMALL LETTER (.*)", name) for name in names)
    return "".join(letter[1].lower() if letter else "?" for letter in greek), error.end


codecs.register_error("spelt", spelt)
