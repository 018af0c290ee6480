"""``asperity measure``."""

from __future__ import annotations

import tempfile
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from . import console, materials, output, passes, variants
from .microgeometries import Wanted

if TYPE_CHECKING:
    from asperity.goniophotometer import Measurement, Microgeometry

FORMATS, TENSORS = (".npz",), (".bsdf",)


def numbers(text: str) -> list[float]:
    """Numbers from ``30,60``."""
    try:
        return [float(number) for number in text.split(",")]
    except ValueError:
        raise typer.BadParameter(f"{text!r}: expected numbers, such as 30,60.") from None


def angles(text: str) -> list[tuple[float, float]]:
    """Directions, θ and φ, from ``60:0,30:180``."""
    pairs = [pair.partition(":")[::2] for pair in text.split(",")]
    try:
        return [(float(theta), float(phi)) for theta, phi in pairs]
    except ValueError:
        raise typer.BadParameter(f"{text!r}: expected directions theta:phi, such as 60:0,30:180.") from None


def counts(text: str) -> list[int]:
    """One or two numbers of cells from ``32`` or ``32x64``."""
    try:
        return [int(count) for count in text.split("x")]
    except ValueError:
        raise typer.BadParameter(f"{text!r}: expected 32x64, or 32 for a window.") from None


Out = Annotated[Path | None, typer.Option("--out", "-o", help="NPZ; named after what is measured if left out.")]
Before = Annotated[
    Path | None,
    typer.Option("--continue", metavar="NPZ", help="Take up this file; if it is finished, add paths to it."),
]
Checkpoint = Annotated[
    float | None, typer.Option(min=0, metavar="SECONDS", help="How often to save what there is; 60 if left out.")
]


def measure(
    ctx: typer.Context,
    target: Annotated[str | None, typer.Argument(metavar="WHAT", help="A model; or mesh; or heightfield.")] = None,
    file: Annotated[Path | None, typer.Argument(metavar="FILE", help="Of the mesh, or the height field.")] = None,
    settings: materials.Settings = None,
    preset: materials.PresetName = None,
    material: materials.MaterialFile = None,
    bsdf: Annotated[str | None, typer.Option(metavar="JSON", help="Of the facets of a mesh or height field.")] = None,
    periodic: Annotated[str | None, typer.Option(help="How a mesh or height field goes on: wrap, or mirror.")] = None,
    spacing: Annotated[float | None, typer.Option(help="Between the samples of a height field.")] = None,
    scale: Annotated[float | None, typer.Option(help="Of the heights of a height field.")] = None,
    level: Annotated[bool, typer.Option("--level", help="Take a height field's tilt away, by least squares.")] = False,
    channel: Annotated[str | None, typer.Option(help="Of an image with several; its name.")] = None,
    theta: Annotated[Any, typer.Option(parser=numbers, metavar="DEGREES", help="Of the incident light.")] = "0,30,60",
    phi: Annotated[Any, typer.Option(parser=numbers, metavar="DEGREES", help="Every theta gets every phi.")] = "0",
    orders: Annotated[int | None, typer.Option(min=1, help="Highest order of scattering; all if left out.")] = None,
    apart: Annotated[int, typer.Option(min=1, help="How many orders are counted apart.")] = 1,
    paths: Annotated[float | None, typer.Option(help="Per direction of incidence; 4 million if left out.")] = None,
    tiles: Annotated[int | None, typer.Option(min=2, help="How many pieces of surface; 32 if left out.")] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Another seed, other pieces: see merge.")] = None,
    sensor: Annotated[str | None, typer.Option(help="hemisphere; retro, mirror or normal (windows); points.")] = None,
    cells: Annotated[Any, typer.Option(parser=counts, metavar="ROWSxCOLUMNS", help="32x64; 32 for a window.")] = None,
    radius: Annotated[float | None, typer.Option(help="Half the width of a window, in degrees.")] = None,
    towards: Annotated[Any, typer.Option(parser=angles, metavar="THETA:PHI,...", help="The points.")] = None,
    wavelengths: Annotated[Any, typer.Option(parser=numbers, metavar="NM", help="In spectral variants.")] = None,
    variant: variants.Variant = None,
    out: Out = None,
    tensor: Annotated[Path | None, typer.Option(metavar="BSDF", help="RGL's tensor file, to write as well.")] = None,
    before: Before = None,
    checkpoint: Checkpoint = None,
    force: output.Force = False,
) -> None:
    """Measure the BSDF of a microgeometry with the virtual goniophotometer: f |cos θo| with standard errors.

    `asperity measure micrograin --set tau_0=0.5 --theta 30,60 --orders 1` measures the grains that a model stands for.
    Ctrl-C stops, and keeps what was measured; so does the end of a scheduler's time. The same command with --continue
    FILE takes it up, to the same bits.
    """
    shape = {"bsdf": bsdf, "periodic": periodic, "spacing": spacing, "scale": scale, "level": level or None}
    wanted = Wanted(target, file, preset, material, settings, shape | {"channel": channel})
    options: dict[str, Any] = {"force": force, "inputs": (file, material, bsdf, *(settings or []))}
    out = ctx.with_resource(to_write(out, before, f"{wanted.name}.npz", **options))
    if tensor is not None:
        default = Path(f"{wanted.name}.bsdf")
        [tensor] = ctx.with_resource(output.files(tensor, default, TENSORS, option="--tensor", **options))
    with console.status("loading"):
        variants.choose(variant)
        from asperity.goniophotometer.sensors import by_name

        geometry, about = wanted.microgeometry()
        collecting = by_name(sensor, cells=cells, radius=radius, towards=towards)
        earlier = None if before is None else to_continue(before, tiles, seed)
    how = given(sensor=collecting, orders=orders, apart=apart, paths=paths, tiles=tiles, seed=seed, before=earlier)
    how |= given(wavelengths=wavelengths, about=about, interval=checkpoint)
    measure_to_files(ctx, out, tensor, geometry, list(product(theta, phi)), how)


def given(**options: Any) -> dict[str, Any]:
    """Those that are not None; the others are left to their defaults."""
    return {name: value for name, value in options.items() if value is not None}


@contextmanager
def to_write(out: Path | None, before: Path | None, default: str, **options: Any) -> Iterator[Path]:
    """The file to write; it may be the one to go on with."""
    if before is not None and (
        out is None or before.resolve() in (out.resolve(), Path(f"{out.resolve()}{FORMATS[0]}"))
    ):
        out, options = before, {"force": True, "option": "--continue"}
    elif before is not None:
        options["inputs"] = (*options["inputs"], before)
    with output.files(out, Path(default), FORMATS, **options) as [path]:
        yield path


def measure_to_files(
    ctx: typer.Context,
    out: Path,
    tensor: Path | None,
    geometry: Microgeometry,
    incident: list[tuple[float, float]],
    how: dict[str, Any],
) -> None:
    """Measure until it is done, or somebody wants to stop; write the files, and say what they hold."""
    if tensor is not None:
        from asperity.goniophotometer import tensor_file

        tensor_file.angles_of_incidence(how["sensor"], incident)  # complains now, not after the tracing
    interrupted, start = ctx.with_resource(passes.interruptible()), time.perf_counter()
    measured = traced(geometry, incident, stop=lambda: bool(interrupted), checkpoint=out, **how)
    seconds = time.perf_counter() - start
    out = save(measured, out)
    report(measured)
    rate = (measured.total_paths - (how["before"].total_paths if "before" in how else 0)) / seconds
    early = "" if measured.finished else "stopped early: "
    typer.echo(f"{early}{out}: {measured.total_paths:.3g} paths, {seconds:.1f} s, {rate:.2g} paths/s")
    if early:
        typer.echo(f"The same command with --continue {out} goes on.")
    if tensor is not None:
        tensor_file.write(measured, tensor)
        typer.echo(tensor)
    typer.echo(f"Try next: asperity plot {out}")


def traced(geometry: Microgeometry, incident: list[tuple[float, float]], **how: Any) -> Measurement:
    """Measure, and say how far it is."""
    from asperity import goniophotometer

    start = time.perf_counter()
    with console.progress("million paths") as progress, warnings.catch_warnings():
        warnings.simplefilter("always", UserWarning)  # every time that a checkpoint fails
        warnings.showwarning = lambda message, *_: console.note(f"warning: {message}")
        task = progress.add_task("compiling", total=0)

        def show(done: int, total: int) -> None:
            rate = f"{done / (time.perf_counter() - start):.2g} paths/s"
            progress.update(task, completed=round(done / 1e6, 1), total=round(total / 1e6, 1), description=rate)

        return goniophotometer.measure(geometry, incident, progress=show, **how)


def save(measured: Measurement, out: Path) -> Path:
    """Write the file; if that fails, because the disk is full, say, write it to the folder for temporary files."""
    try:
        measured.save(out)
        return out
    except OSError as error:
        rescued = Path(tempfile.mkdtemp(prefix="asperity-")) / out.name
        measured.save(rescued)
        typer.echo(f"warning: cannot write {out}: {error.strerror}. Kept as {rescued}.", err=True)
        return rescued


def to_continue(file: Path, tiles: int | None, seed: int | None) -> Measurement:
    """The measurement to go on with, if it has the tiles that are asked for."""
    from asperity.goniophotometer import measurement

    earlier = measurement.Measurement.load(file)
    measurement.check_tiles(earlier, tiles, seed, str(file))
    if not earlier.finished:
        typer.echo(f"{file} was to have {earlier.goal.sum():.3g} paths per direction: it gets these first.")
    return earlier


def report(measured: Measurement) -> None:
    """Print the table of albedos, a line for each direction of incidence."""
    from asperity.goniophotometer.measurement import with_error

    names = measured.channels if measured.colourful else [""]
    balance = measured.balance
    table = Table("θ [°]", "φ [°]", *(["channel"] if measured.colourful else []), *balance)
    for row, (theta, phi) in enumerate(measured.incident):
        for channel, name in enumerate(names):
            values = (with_error(part.value[row, channel], part.error[row, channel]) for part in balance.values())
            table.add_row(f"{theta:g}", f"{phi:g}", *filter(None, [name]), *values)
    console.stdout().print(table)
    if measured.wants_tiles:
        typer.echo(
            "The surface's own randomness makes most of these errors: more --tiles lower them, more --paths do not."
        )
