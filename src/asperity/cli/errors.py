"""The one place where an error becomes a line on stderr and an exit code."""

from __future__ import annotations

import codecs
import io
import re
import sys
import unicodedata
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperGroup

from asperity.errors import AsperityError

FAULTS = (AsperityError, RuntimeError, ImportError, OSError, MemoryError)
"""Of what was asked for, or of the machine. Mitsuba knows only RuntimeError, and ImportError for variants."""

NOISE = {
    r"\[\w+(?:\.cpp:\d+)?\] ": "",
    r'(?:At|While loading) dictionary node "root": ': "",
    r'(?:At|While loading) dictionary node "(.*?)": ': r"\1: ",
    r'failed to instantiate \w+ plugin of type ".*?": ': "",
}
"""In Mitsuba's messages, and what to say instead."""


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


def one_line(message: str) -> str:
    """Mitsuba's message without what only its authors need: C++ files, plugin kinds, tracebacks of our models."""
    head, traceback, tail = message.rpartition("Traceback (most recent call last):\n")
    text = head + re.sub(r"\A(?:\s.*\n)*(?:[\w.]+: )?", "", tail) if traceback else tail
    for noise, instead in NOISE.items():
        text = re.sub(noise, instead, text)
    text = re.sub(r'Plugin "(.*?)" not found!', lambda plugin: no_plugin(plugin[1]), text)
    return " ".join(text.split())


def no_plugin(name: str) -> str:
    """What to say about a plugin that nobody has."""
    import mitsuba as mi

    from asperity.models import MODELS, PHASES, TEXTURES

    mitsubas = (path.stem.removeprefix("lib") for path in (Path(mi.__file__).parent / "plugins").iterdir())
    nearest = get_close_matches(name, [*MODELS, *TEXTURES, *PHASES, *mitsubas], n=1)
    return f"there is no plugin {name!r}." + (f" Did you mean {nearest[0]!r}?" if nearest else "")
