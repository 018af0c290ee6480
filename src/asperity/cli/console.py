"""Where the commands print: tables and results to stdout, progress to stderr."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from rich.console import Console

if TYPE_CHECKING:
    from rich.progress import Progress
    from rich.status import Status

WIDTH = 120
"""Of tables that go to a file or a pipe."""


def stdout() -> Console:
    """The console for results; brackets are brackets, not markup."""
    return Console(markup=False, highlight=False, width=None if sys.stdout.isatty() else WIDTH)


def stderr() -> Console:
    """The console for progress, which a file or a pipe does not want."""
    console = Console(stderr=True, markup=False, highlight=False)
    console.quiet = not console.is_terminal
    return console


def status(text: str) -> Status:
    """A spinner."""
    return stderr().status(text)


def progress(unit: str) -> Progress:
    """A progress bar that counts ``unit``."""
    # Here, for the sake of `asperity --help`.
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    count = TextColumn(f"{{task.completed:g}}/{{task.total:g}} {unit}")
    columns = (TextColumn("{task.description}"), BarColumn(), count, TimeElapsedColumn(), TimeRemainingColumn())
    return Progress(*columns, console=stderr(), transient=True)
