"""``asperity fit``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from asperity.errors import ParameterError
from asperity.materials import changed, resolve

from . import console, output, passes, variants
from .compare import previews
from .plot import is_text, suited

if TYPE_CHECKING:
    from asperity.fitting import Fit
    from asperity.materials import Material
    from asperity.measured import BRDF

ALL = "all"
FORMATS = (".json",)
FIGURES = (".png", ".pdf", ".svg")


def names(text: str | None) -> list[str] | None:
    """Names from ``alpha,int_ior``."""
    return None if text is None else [name.strip() for name in text.split(",") if name.strip()]


def fit(
    ctx: typer.Context,
    data: Annotated[str, typer.Argument(metavar="DATA", help="Measured: .binary, .bsdf, .csv, .npz; or any material.")],
    model: Annotated[
        str, typer.Option("--model", help="A model, a preset, a file, JSON; all compares what there is.")
    ] = ALL,
    plus: Annotated[str | None, typer.Option("--plus", help="diffuse adds a Lambertian.")] = None,
    free: Annotated[
        str | None, typer.Option("--free", metavar="A,B", help="Parameters to fit. Default: all that are declared.")
    ] = None,
    fix: Annotated[
        list[str] | None,
        typer.Option("--fix", metavar="NAME=VALUE", help="A parameter that keeps a value. Repeatable."),
    ] = None,
    loss: Annotated[str, typer.Option("--loss", help="log (of 1 + f cos), linear, relative, errors.")] = "log",
    robust: Annotated[
        str, typer.Option("--robust", help="linear (not robust), soft_l1, huber, cauchy: outliers count less.")
    ] = "linear",
    grazing: Annotated[float, typer.Option("--grazing", help="Degrees beyond which pairs are left out.")] = 85.0,
    saturation: Annotated[
        float | None, typer.Option("--saturation", help="Values of f to leave out from here.")
    ] = None,
    pairs: Annotated[int, typer.Option("--pairs", help="How many pairs of directions are fitted.")] = 4096,
    seed: Annotated[int, typer.Option("--seed", help="Of the drawing of pairs, and of the starts.")] = 0,
    columns: Annotated[
        list[str] | None,
        typer.Option("--column", metavar="NAME=COLUMN", help="What a CSV calls theta_i, phi_o, value. Repeatable."),
    ] = None,
    plot: Annotated[bool, typer.Option(help="Draw the residuals, too.")] = True,
    preview: Annotated[bool, typer.Option(help="And render data and model.")] = True,
    json_: Annotated[bool, typer.Option("--json", help="Print the numbers as JSON.")] = False,
    variant: variants.Variant = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Material file, JSON. Default: DATA-MODEL.json.")
    ] = None,
    force: output.Force = False,
) -> None:
    """Fit a model to a measured BRDF, or all of them: parameters, how sure they are, and how good it is.

    It writes a material file, which render, plot and compare take, and a figure of the residuals.
    """
    fixed = changed({}, fix or [])
    default = Path(f"{label(data)}-{label(model)}.json")
    inputs = [text if is_text(text) else Path(text) for text in (data, model)]
    [path] = ctx.with_resource(output.files(out, default, FORMATS, force=force, inputs=inputs))
    figures = output.files(path.with_suffix(".png"), default, FIGURES, force=force)
    picture = ctx.with_resource(figures)[0] if plot else None
    with console.status("reading"):
        material = read(data, columns)
        variants.choose(variant or suited([material]))
        from asperity import drawing, fitting

        measured = fitting.data(material)
    options: dict[str, Any] = {"plus": plus, "free": names(free), "fix": fixed, "loss": loss, "robust": robust}
    options |= {"grazing": grazing, "saturation": saturation, "pairs": pairs, "seed": seed}
    ranked = followed(measured, model, options)
    best = ranked[0]
    best.save(path)
    if picture is not None:
        with console.status("drawing"):
            rendered = previews(material, resolve(best.material)) if preview else None
            drawing.style.save(best.plot(rendered), picture)
    if json_:
        numbers = [one.numbers() for one in ranked]
        typer.echo(json.dumps(numbers if model == ALL else numbers[0], indent=2))
        return
    if model == ALL:
        console.stdout().print(ranking(ranked))
    report(best, measured)
    for written in (path, picture):
        if written is not None:
            typer.echo(written)


def label(what: str) -> str:
    """What to call data or a model in the names of files: its name, or that of its file."""
    return "fit" if is_text(what) else Path(what).stem.replace(" ", "").replace(",", "-")


def read(data: str, columns: list[str] | None) -> Material:
    """The data, a material like any other; with the columns of a CSV that the user named."""
    if not columns:
        return resolve(data)
    from asperity import measured

    return resolve(measured.load(data, columns=dict(column.partition("=")[::2] for column in columns)))


def followed(data: BRDF, model: str, options: dict[str, Any]) -> list[Fit]:
    """The fits, the best first, with a progress bar; Ctrl-C keeps the best until then."""
    from asperity import fitting

    with passes.interruptible() as interrupted, console.progress("steps") as progress:
        task = progress.add_task("fitting", total=1)

        def told(name: str, done: int, total: int) -> None:
            progress.update(task, completed=done, total=total, description=name)
            if interrupted:
                raise KeyboardInterrupt

        if model != ALL:
            return [fitting.fit(data, model, progress=told, **options)]
        if options["plus"] or options["free"]:
            raise ParameterError("--plus and --free are of one model; --model all has its own.")
        return fitting.rank(data, progress=told, **options)


def ranking(found: list[Fit]) -> Table:
    """A row a model."""
    table = Table("model", "AIC, more than the best", "log-cosine RMS", "relative", "bias", "numbers", "seconds")
    for one in found:
        errors = one.errors
        numbers = (f"{one.aic - found[0].aic:.1f}", f"{errors.log_cosine:.4f}", f"{errors.relative:.1%}")
        count, seconds = str(len(one.parameters)), f"{one.seconds:.1f}"
        table.add_row(one.name, *numbers, bias(one), count, seconds)
    return table


def report(found: Fit, data: BRDF) -> None:
    """Print parameters, errors, and what is to be said of them."""
    table = Table(found.name, "value", "standard error", "allowed", "")
    for one in found.parameters:
        table.add_row(one.name, f"{one.value:.4g}", f"{one.error:.2g}", f"{one.low:g} to {one.high:g}", one.remark)
    console.stdout().print(table)
    errors, worst = found.errors, found.errors.worst
    lines = [
        f"{found.pairs} of {len(data)} pairs fitted in {found.seconds:.1f} s; errors are of {len(found.data)}:",
        f"log-cosine RMS {errors.log_cosine:.4f}" + ("" if errors.noise is None else f" (noise: {errors.noise:.4f})"),
        f"relative RMS {errors.relative:.1%}, RMS of f cos {errors.linear:.4g} / sr, bias {bias(found)}",
        f"worst {worst.error:+.3f} in {worst.channel} at θ_i, φ_i = {worst.incident}, θ_o, φ_o = {worst.outgoing}",
        *told(found),
    ]
    typer.echo("\n".join(lines))


def bias(found: Fit) -> str:
    """How much too bright it is, on the whole; data that are black have none."""
    return "none" if found.errors.bias != found.errors.bias else f"{found.errors.bias:+.1%}"


def told(found: Fit) -> list[str]:
    """What the tables do not say: correlations, and that it was interrupted."""
    return [line for line in found.statements() if "told apart" in line or "interrupted" in line]
