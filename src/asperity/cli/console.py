"""Where the commands print: tables and results to stdout, progress to stderr."""

from __future__ import annotations

import sys
import time
from contextlib import suppress
from datetime import timedelta
from typing import TYPE_CHECKING, Any

from rich.console import Console

if TYPE_CHECKING:
    from rich.progress import Progress
    from rich.status import Status

WIDTH = 120
"""Of tables that go to a file or a pipe."""
INTERVAL = 30.0
"""Seconds from one line of progress in a log to the next."""


def stdout() -> Console:
    """The console for results; brackets are brackets, not markup."""
    return Console(markup=False, highlight=False, width=None if sys.stdout.isatty() else WIDTH)


def stderr() -> Console:
    """The console for what moves, which a file or a pipe does not want."""
    console = Console(stderr=True, markup=False, highlight=False)
    console.quiet = not console.is_terminal
    return console


def status(text: str) -> Status:
    """A spinner."""
    return stderr().status(text)


def progress(unit: str) -> Progress | Log:
    """A progress bar that counts ``unit``; lines now and then, where it would go to a file or a pipe."""
    # Here, for the sake of `asperity --help`.
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    if not stderr().is_terminal:
        return Log(unit)
    count = TextColumn(f"{{task.completed:g}}/{{task.total:g}} {unit}")
    columns = (TextColumn("{task.description}"), BarColumn(), count, TimeElapsedColumn(), TimeRemainingColumn())
    return Progress(*columns, console=stderr(), transient=True)


class Log:
    """What a `rich.progress.Progress` does here, in lines to stderr; none for jobs that are done before the first."""

    def __init__(self, unit: str):
        self.unit = unit

    def __enter__(self) -> Log:
        self.start = self.printed = time.monotonic()
        return self

    def __exit__(self, *_: Any) -> None:
        pass

    def add_task(self, description: str, total: float) -> Any:
        """Say what is to be done; the only task."""
        self.total = total

    def update(self, task: Any, completed: float, total: float | None = None, description: str = "") -> None:
        """Say how far it is."""
        self.total, now = total or self.total, time.monotonic()
        if now < self.printed + INTERVAL:
            return
        self.printed = now
        left = (self.total - completed) * (now - self.start) / completed if completed else float("inf")
        rest = f", about {timedelta(seconds=round(left))} left" if left < 1e8 else ""
        log(f"{completed:g}/{self.total:g} {self.unit}, {description}{rest}")


def log(text: str) -> None:
    """Print a line to stderr where no bar moves."""
    if not stderr().is_terminal:
        note(text)


def note(text: str) -> None:
    """Print a line to stderr. That nobody reads it any more is no reason to lose what is being computed."""
    with suppress(OSError):
        print(text, file=sys.stderr, flush=True)
