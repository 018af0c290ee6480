"""``asperity measure``."""

from __future__ import annotations

import json
import tempfile
import time
import warnings
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from asperity.errors import ParameterError, UnknownNameError

from . import console, materials, output, passes, registry, variants

if TYPE_CHECKING:
    from asperity.goniophotometer import Measurement, Microgeometry
    from asperity.goniophotometer.sensors import Sensor

FORMATS, TENSORS = (".npz",), (".bsdf",)
SHAPES = {"mesh": ("bsdf", "periodic"), "heightfield": ("spacing", "scale", "bsdf", "periodic", "level", "channel")}
"""What is read from files, and the options that describe it."""
SENSORS = {
    "hemisphere": ("cells",),
    "retro": ("cells", "radius"),
    "mirror": ("cells", "radius"),
    "normal": ("cells", "radius"),
    "points": ("towards",),
}
"""Sensors, and the options that shape them."""


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
    paths: Annotated[float, typer.Option(help="Per direction of incidence.")] = 4e6,
    tiles: Annotated[int | None, typer.Option(min=2, help="How many pieces of surface; 32 if left out.")] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Another seed, other pieces: see merge.")] = None,
    sensor: Annotated[str | None, typer.Option(help="hemisphere; retro, mirror or normal (windows); points.")] = None,
    cells: Annotated[Any, typer.Option(parser=counts, metavar="ROWSxCOLUMNS", help="32x64; 32 for a window.")] = None,
    radius: Annotated[float | None, typer.Option(help="Half the width of a window, in degrees.")] = None,
    towards: Annotated[Any, typer.Option(parser=angles, metavar="THETA:PHI,...", help="The points.")] = None,
    wavelengths: Annotated[Any, typer.Option(parser=numbers, metavar="NM", help="In spectral variants.")] = None,
    variant: variants.Variant = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="NPZ; named after what is measured if left out.")
    ] = None,
    tensor: Annotated[Path | None, typer.Option(metavar="BSDF", help="RGL's tensor file, to write as well.")] = None,
    before: Annotated[
        Path | None,
        typer.Option("--continue", metavar="NPZ", help="Take up this file; if it is finished, add paths to it."),
    ] = None,
    checkpoint: Annotated[float, typer.Option(min=0, metavar="SECONDS", help="How often to save what there is.")] = 60,
    force: output.Force = False,
) -> None:
    """Measure the BSDF of a microgeometry with the virtual goniophotometer: f |cos θo| with standard errors.

    `asperity measure micrograin --set tau_0=0.5 --theta 30,60 --orders 1` measures the grains that a model stands for.
    Ctrl-C stops, and keeps what was measured; so does the end of a scheduler's time. The same command with --continue
    FILE takes it up, to the same bits.
    """
    if sum(way is not None for way in (target, preset, material)) != 1:
        raise ParameterError(f"give one of: the name of a model, {', '.join(SHAPES)}, --preset, --material.")
    name = preset or (file or material or Path(target or "")).stem
    options: dict[str, Any] = {"force": force, "inputs": (file, material, bsdf, *(settings or []))}
    out = ctx.with_resource(to_write(out, before, f"{name}.npz", **options))
    if tensor is not None:
        [tensor] = ctx.with_resource(output.files(tensor, Path(f"{name}.bsdf"), TENSORS, option="--tensor", **options))
    with console.status("loading"):
        variants.choose(variant)
        shape = {"bsdf": bsdf, "periodic": periodic, "spacing": spacing, "scale": scale}
        shape |= {"level": level or None, "channel": channel}
        about: dict[str, Any] = {}
        if target in SHAPES:
            geometry = from_file(target, file, {**shape, "set": settings or None})
        else:
            about["model"] = described(target, preset, material, settings)
            refuse({"file": file, **shape}, (), name)
            geometry = of_model(about["model"])
        chosen = sensor_of(sensor, {"cells": cells, "radius": radius, "towards": towards})
        earlier = None if before is None else to_continue(before, tiles, seed)
    if earlier is not None and not earlier.finished:
        typer.echo(f"{before} was to have {earlier.goal.sum():.3g} paths per direction: it gets these first.")
    incident = list(product(theta, phi))
    if tensor is not None:
        from asperity.goniophotometer import tensor_file

        tensor_file.angles_of_incidence(chosen, incident)  # complains now, not after the tracing
    effort = {"paths": paths, "tiles": tiles, "seed": seed, "wavelengths": wavelengths, "before": earlier}
    start, interrupted = time.perf_counter(), ctx.with_resource(passes.interruptible())
    measured = traced(
        geometry,
        incident,
        sensor=chosen,
        orders=orders,
        apart=apart,
        about=about,
        stop=lambda: bool(interrupted),
        checkpoint=lambda part: save_part(part, out),
        interval=checkpoint,
        **{option: value for option, value in effort.items() if value is not None},
    )
    seconds = time.perf_counter() - start
    out = save(measured, out)
    report(measured)
    rate = (measured.total_paths - (earlier.total_paths if earlier else 0)) / seconds
    early = "" if measured.finished else "stopped early: "
    typer.echo(f"{early}{out}: {measured.total_paths:.3g} paths, {seconds:.1f} s, {rate:.2g} paths/s")
    if early:
        typer.echo(f"The same command with --continue {out} goes on.")
    if tensor is not None:
        tensor_file.write(measured, tensor)
        typer.echo(tensor)
    typer.echo(f"Try next: asperity plot {out}")


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


def traced(geometry: Microgeometry, incident: list[tuple[float, float]], **options: Any) -> Measurement:
    """Measure, and say how far it is."""
    from asperity import goniophotometer

    start = time.perf_counter()
    with console.progress("million paths") as progress, warnings.catch_warnings(record=True) as warned:
        task = progress.add_task("compiling", total=0)

        def show(done: int, total: int) -> None:
            rate = f"{done / (time.perf_counter() - start):.2g} paths/s"
            progress.update(task, completed=round(done / 1e6, 1), total=round(total / 1e6, 1), description=rate)

        measured = goniophotometer.measure(geometry, incident, progress=show, **options)
    for warning in warned:
        typer.echo(f"warning: {warning.message}", err=True)
    return measured


def save_part(measured: Measurement, out: Path) -> None:
    """Write what there is so far; if that fails, the next time may be luckier."""
    try:
        measured.save(out)
    except OSError as error:
        console.note(f"warning: no checkpoint: cannot write {out}: {error.strerror}.")


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


def refuse(options: dict[str, Any], allowed: Collection[str], what: str) -> None:
    """Raise if an option is given that would be ignored."""
    for option, value in options.items():
        if value is not None and option not in allowed:
            raise ParameterError(f"{option}: makes no sense with {what}.")


def described(
    target: str | None, preset: str | None, material: Path | None, settings: list[str] | None
) -> dict[str, Any]:
    """The description of the model that was asked for, checked."""
    if target is None:
        description = materials.chosen(preset, material, settings).material
    else:
        if target not in registry.models():  # nor is it a shape
            raise UnknownNameError("microgeometry", target, [*with_microgeometry(), *SHAPES])
        description = {"type": target}
        materials.apply(description, settings or [])
    materials.check_material(description)
    return description


def with_microgeometry() -> list[str]:
    """Names of the models that have one."""
    return [name for name, model in registry.models().items() if hasattr(model, "microgeometry")]


def of_model(description: dict[str, Any]) -> Microgeometry:
    """The microgeometry that a model stands for."""
    name = description["type"]
    if name not in with_microgeometry():
        raise ParameterError(
            f"{name!r} has no microgeometry to measure. Those that have: {', '.join(with_microgeometry())}."
        )
    geometry = registry.model(name).microgeometry(description)
    try:
        json.dumps([description, geometry.description])
    except TypeError as error:
        raise ParameterError(f"{name}: a measurement cannot keep its description: {error}.") from error
    return geometry


def from_file(kind: str, file: Path | None, options: dict[str, Any]) -> Microgeometry:
    """A mesh or a height field."""
    from asperity.goniophotometer.mesh import HeightField, Mesh

    refuse(options, SHAPES[kind], f"a {kind}")
    if file is None:
        raise ParameterError(f"{kind}: expected a file after it.")
    given = {option: value for option, value in options.items() if value is not None}
    if "bsdf" in given:
        given["bsdf"] = facets(given["bsdf"])
    if kind == "mesh":
        return Mesh(file, **given)
    if "spacing" not in given:
        raise ParameterError("spacing: a height field needs the distance between its samples.")
    field = HeightField.load(file, **given)
    typer.echo(f"{file}: {field.account}")
    return field


def facets(text: str) -> dict[str, Any]:
    """The BSDF in ``text``, checked."""
    try:
        description = json.loads(text)
    except json.JSONDecodeError as error:
        raise ParameterError(f"--bsdf {text}: no JSON; column {error.colno}: {error.msg}.") from error
    if not (isinstance(description, dict) and "type" in description):
        raise ParameterError(f'--bsdf {text}: expected an object in braces, such as {{"type": "diffuse"}}.')
    materials.check_material(description)
    return description


def sensor_of(kind: str | None, options: dict[str, Any]) -> Sensor:
    """The sensor that the options describe."""
    from asperity.goniophotometer import Hemisphere, Points, Window

    kind = kind or ("points" if options["towards"] else "hemisphere")
    if kind not in SENSORS:
        raise UnknownNameError("sensor", kind, SENSORS)
    refuse(options, SENSORS[kind], f"sensor {kind}")
    if kind == "points":
        if not options["towards"]:
            raise ParameterError("towards: sensor points needs the directions, such as 60:0,30:180.")
        return Points(tuple(options["towards"]))
    cells, form = options["cells"] or [], "ROWSxCOLUMNS" if kind == "hemisphere" else "N"
    if len(cells) not in (0, 1 + form.count("x")):
        raise ParameterError(f"cells: sensor {kind} takes {form}.")
    if kind == "hemisphere":
        return Hemisphere(*cells)
    given = {"n": cells[0] if cells else None, "radius": options["radius"]}
    return Window(kind, **{name: value for name, value in given.items() if value is not None})


def to_continue(file: Path, tiles: int | None, seed: int | None) -> Measurement:
    """The measurement to add to; raises if it has other tiles than those that are asked for."""
    from asperity.goniophotometer import Measurement

    earlier = Measurement.load(file)
    for option, value, had in (("tiles", tiles, {len(earlier.labels)}), ("seed", seed, set(earlier.labels[:, 0]))):
        if value is not None and {value} != had:
            raise ParameterError(
                f"{option} = {value}: {file} has {', '.join(map(str, sorted(had)))}. "
                "Measure other tiles into a file of their own, and merge both by `asperity merge`."
            )
    return earlier


def report(measured: Measurement) -> None:
    """Print the table of albedos, a line for each direction of incidence."""
    import numpy as np

    names = measured.about["channels"]
    shown = {"albedo": measured.total_albedo}
    if measured.orders > 1:
        more = " and more" if measured.about["limit"] > measured.orders else ""
        for k in range(measured.orders):
            part = type(measured.albedo)(*(values[:, k] for values in measured.albedo))
            shown[f"order {k + 1}{more if k == measured.orders - 1 else ''}"] = part
    shown |= {what: part for what in ("transmitted", "cut") if np.any((part := getattr(measured, what)).value > 1e-6)}
    differ = np.ptp(measured.energy, axis=-1).any()
    table = Table("θ [°]", "φ [°]", *(["channel"] if differ else []), *shown)
    for row, (theta, phi) in enumerate(measured.incident):
        for channel, name in enumerate(names if differ else names[:1]):
            values = (with_error(part.value[row, channel], part.error[row, channel]) for part in shown.values())
            table.add_row(f"{theta:g}", f"{phi:g}", *([name] if differ else []), *values)
    console.stdout().print(table)
    value, error = measured.total_albedo
    noise = np.sqrt(np.clip(value * (1 - value), 0, None) / np.maximum(measured.paths.sum(axis=0), 1)[:, None])
    if np.any(error > 4 * noise) and np.all(noise > 0):
        typer.echo(
            "The surface's own randomness makes most of these errors: more --tiles lower them, more --paths do not."
        )


def with_error(value: float, error: float) -> str:
    """A value with as many digits as its standard error, which gets two, deserves."""
    import numpy as np

    if not np.isfinite(value):
        return "not measured"
    if not (np.isfinite(error) and error > 0):
        return f"{value:.4g} ± {'0' if error == 0 else '?'}"
    digits = int(np.clip(1 - np.floor(np.log10(error)), 0, 6))
    return f"{value:.{digits}f} ± {error:.{digits}f}"
