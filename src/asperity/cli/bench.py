"""``asperity bench``."""

from __future__ import annotations

import json
import subprocess
import time
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.box import SIMPLE_HEAD
from rich.table import Table

from asperity import __version__, peers
from asperity.errors import ParameterError
from asperity.files import atomically
from asperity.materials import resolve

from . import console, materials, output, passes, registry, variants

COLUMNS = ("eval_pdf", "sample", "bare", "preview", "filled", "first", "memory", "envmap", "point")
"""Calls, frames, the first picture, and noise with work under an environment map and a point light."""


class StoppedError(Exception):
    """Somebody wants to stop; the group that is being timed is left out."""


def bench(
    ctx: typer.Context,
    targets: Annotated[
        list[str] | None,
        typer.Argument(metavar="[MATERIAL]...", help="Models, presets, files, JSON; all models if there are none."),
    ] = None,
    settings: materials.Settings = None,
    against: Annotated[str | None, typer.Option(help="The material to compare with, instead of Mitsuba's.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Small frames of what tells most.")] = False,
    json_file: Annotated[Path | None, typer.Option("--json", metavar="FILE", help="Write all numbers.")] = None,
    variant: variants.Variant = None,
    force: output.Force = False,
) -> None:
    """Time BSDFs beside Mitsuba's own: calls, frames, the first picture; noise and memory.

    The materials of a table take turns. Ratios are medians over rounds, ± half the distance of the quartiles. The last
    two columns are the variance of pixels at equal samples, and below it variance times time.
    """
    with console.status("loading"):
        variants.choose(variant)
        from asperity.lab import bench as lab

        groups = chosen(targets or [], settings or [], against, quick)
    effort = lab.QUICK if quick else lab.FULL
    path = None
    if json_file is not None:
        (path,) = ctx.with_resource(output.files(json_file, json_file, (".json",), force=force, option="--json"))
    interrupted = ctx.with_resource(passes.interruptible())
    report, start = about() | lab.circumstances() | effort._asdict() | {"rows": {}}, time.perf_counter()
    typer.echo(f"{report['machine']}, {report['threads']} threads, load {report['load']:.1f}; {report['variant']}")
    for group in groups:
        try:
            rows = timed(group, effort, interrupted)
        except StoppedError:
            break
        report["rows"] |= rows
        report["seconds"] = round(time.perf_counter() - start)
        console.stdout().print(tabulated(rows))
        if path is not None:  # after each group: a long run may end early
            with atomically(path) as part:
                part.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    early = "stopped early; " if interrupted else ""
    typer.echo(f"{early}{time.perf_counter() - start:.0f} s" + (f"; {path}" if path and report["rows"] else ""))
    raise typer.Exit(1 if interrupted else 0)


def timed(group: peers.Group, effort: Any, interrupted: list[int]) -> dict[str, dict[str, Any]]:
    """The rows of a group, with progress; raises StoppedError."""
    from asperity.lab import bench as lab

    reference, done = next(iter(group)), 0
    with console.progress("steps") as progress:
        task = progress.add_task("", total=lab.steps(group, effort))

        def tick(column: str) -> None:
            nonlocal done
            done += 1
            progress.update(task, completed=done, description=f"over {reference}: {column}")
            if interrupted:
                raise StoppedError

        return lab.measure(group, effort, tick)


def chosen(targets: list[str], settings: list[str], against: str | None, quick: bool) -> list[peers.Group]:
    """Groups of materials, each with its reference first; raises ParameterError."""
    if not targets and (settings or against):
        raise ParameterError("--set and --against: name a material.")
    groups = [] if targets else peers.groups(quick)
    for target in targets:
        models = None if settings or against else peers.of_model(target)
        if models is not None and target in registry.models():
            groups.append({name: one for name, one in models.items() if not (quick and name in peers.EXTRA)})
            continue
        name, description = described(target, settings)
        group = peers.beside(name, description)
        if against is not None:
            other, reference = described(against, [])
            group = {other if other != name else f"{other}, reference": reference, name: description}
        groups.append(group)
    return groups


def described(target: str, settings: list[str]) -> tuple[str, dict[str, Any]]:
    """The name and the description of a material, which other processes can load too."""
    from asperity.lab.bench import first

    material = resolve(target, settings)
    if material.description is None:
        raise ParameterError(f"{target}: only what has a description can be timed; a measurement has none.")
    material.load()  # complains in one line
    first.told(material.description)
    return ", ".join([material.name, *settings]), material.description


def about() -> dict[str, Any]:
    """Which code."""

    def git(*words: str) -> str:
        command = ["git", "-C", str(Path(__file__).parent), *words]
        try:
            return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()
        except OSError:
            return ""

    if not git("ls-files", Path(__file__).name):  # installed, perhaps within somebody's repository
        return {"asperity": __version__, "commit": __version__}
    commit = git("rev-parse", "--short", "HEAD")
    return {"asperity": __version__, "commit": commit + ("+" if git("status", "--porcelain", "-uno") else "")}


def tabulated(rows: dict[str, dict[str, Any]]) -> Table:
    """The rows of a group."""
    reference = next(iter(rows))
    table = Table("", *COLUMNS, title=f"over {reference}", box=SIMPLE_HEAD, padding=(0, 1, 0, 0), pad_edge=False)
    table.columns[0].no_wrap = True
    for name, row in rows.items():
        cells = [f"{spread(row[call]['ratio'])}\n{brief(row[call]['time'][1])} ns" for call in ("eval_pdf", "sample")]
        for frame in ("bare", "preview", "filled"):
            cells.append(f"{spread(row[frame]['ratio'])}\n{brief(1e3 * row[frame]['time'][1])} ms")
        cells.append(f"{spread(row['first']['ratio'])}\n{row['first']['time'][1]:.2f} s")
        cells.append(f"{row['memory']['ratio'][1]:.2f}\n{row['memory']['value'][1]:.0f} MiB")
        cells += [f"{spread(row[frame]['noise'])}\n{spread(row[frame]['work'])}" for frame in ("filled", "point")]
        table.add_row(name.replace(", ", ",\n", 1), *cells)
    return table


def brief(number: float) -> str:
    """Three digits, or all before the point."""
    return f"{number:.3g}" if number < 100 else f"{number:.0f}"


def spread(quartiles: list[float]) -> str:
    """The median, and half the distance of the others."""
    low, middle, high = quartiles
    half = (high - low) / 2
    return f"{middle:.2f}±{half:.2f}" if middle < 10 else f"{middle:.3g}±{half:.2g}"
