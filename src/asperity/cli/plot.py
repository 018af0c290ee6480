"""``asperity plot``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from asperity.errors import ParameterError, UnreadableFileError, refuse_unused
from asperity.materials import resolve

from . import console, materials, output, variants

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from asperity.materials import Material

FORMATS = (".png", ".pdf", ".svg")
VIEW, SPECTRAL = "lobes", "llvm_ad_spectral"


def numbers(name: str) -> Callable[[str], list[float]]:
    """A parser of numbers between commas, for the option of this name."""

    def parse(text: str) -> list[float]:
        try:
            return [float(number) for number in text.split(",")]
        except ValueError:
            raise typer.BadParameter(f"{name} {text!r}: expected numbers, such as 0,30,60.") from None

    return parse


def plot(
    ctx: typer.Context,
    given: Annotated[
        list[str],
        typer.Argument(metavar="MATERIAL...", help="Presets, BSDFs, files, JSON; measurements."),
    ],
    view: Annotated[
        str | None,
        typer.Option(
            help="lobes, slices, hemisphere, rusinkiewicz, albedo, lobe3d, spectrum, sampling. If left out: lobes; "
            "of one measurement, all that was measured."
        ),
    ] = None,
    theta: Annotated[
        Any, typer.Option(parser=numbers("--theta"), metavar="DEGREES,...", help="Angles of incidence: 0,30,60.")
    ] = None,
    phi: Annotated[float | None, typer.Option(metavar="DEGREES", help="Azimuth of incidence.")] = None,
    scale: Annotated[str | None, typer.Option(help="linear or log.")] = None,
    cosine: Annotated[bool, typer.Option("--cosine/--no-cosine", help="f cos θo, or f.")] = True,
    channel: Annotated[str | None, typer.Option(help="mean, each, or the name of one: R.")] = None,
    wavelengths: Annotated[
        Any, typer.Option(parser=numbers("--wavelengths"), metavar="NM,...", help="Channels of spectral variants.")
    ] = None,
    isolines: Annotated[bool, typer.Option("--isolines", help="On maps of the hemisphere.")] = False,
    parts: Annotated[bool | None, typer.Option(help="Lobes or orders of the albedo.")] = None,
    theta_o: Annotated[
        Any,
        typer.Option(parser=numbers("--theta-o"), metavar="DEGREES,...", help="Of a spectrum; -45: to the light."),
    ] = None,
    phi_d: Annotated[float | None, typer.Option(metavar="DEGREES", help="Of the view rusinkiewicz.")] = None,
    settings: materials.Settings = None,
    model: Annotated[bool | None, typer.Option(help="Draw the model, too, that a whole measurement is of.")] = None,
    variant: variants.Variant = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="PNG, PDF or SVG. Default: MATERIAL-VIEW.png.")
    ] = None,
    force: output.Force = False,
) -> None:
    """Plot materials: their lobes, slices, maps, albedos, spectra or sampling; models and measurements together.

    --set changes the last of them.
    """
    options = {
        "theta": theta, "phi": phi, "scale": scale, "cosine": None if cosine else False, "channel": channel,
        "wavelengths": wavelengths, "isolines": isolines or None, "parts": parts, "theta_o": theta_o, "phi_d": phi_d,
    }  # fmt: skip
    options = {name: value for name, value in options.items() if value is not None}
    whole = view is None and len(given) == 1 and is_measurement(given[0])
    if whole:
        refuse_unused(options, (), "a whole measurement: choose a --view")
    elif model is not None:
        raise ParameterError("model: makes no sense with a view. Name the model as another material.")
    inputs = [one if is_text(one) else Path(one) for one in given] + list(settings or [])
    default = default_path(given[0], None if whole else view or VIEW)
    [path] = ctx.with_resource(output.files(out, default, FORMATS, force=force, inputs=inputs))
    with console.status("drawing"):
        # Settings are of the last, so that a material can be drawn beside itself.
        shown = [*(resolve(one) for one in given[:-1]), resolve(given[-1], settings or [])]
        variants.choose(variant or (SPECTRAL if view == "spectrum" or wavelengths else suited(shown)))
        from asperity import drawing

        if whole:
            figure = measurement(shown[0].measured, model is not False)
        else:
            figure = drawing.plot(shown, view or VIEW, **options)
        drawing.style.save(figure, path)
    typer.echo(path)


def is_measurement(given: str) -> bool:
    """Whether an argument is a measurement of the virtual goniophotometer."""
    if is_text(given) or not given.lower().endswith(".npz"):
        return False
    from asperity.measured import archive

    try:
        return not archive.is_brdf(Path(given))
    except UnreadableFileError:  # which reading it says, after what is wrong with the options
        return True


def is_text(given: str) -> bool:
    """Whether an argument is a description itself."""
    return given.lstrip().startswith(("{", "[", "<"))


def default_path(given: str, view: str | None) -> Path:
    """Where the picture goes: beside a measurement, and named by the view, if there is one; else here."""
    stem = "material" if is_text(given) else Path(given).stem or str(output.NAME)
    folder = Path(given).parent if is_measurement(given) else Path()
    return folder / (f"{stem}-{view}.png" if view else f"{stem}.png")


def suited(shown: Sequence[Material]) -> str | None:
    """The variant with the channels of the first measurement; None if any will do."""
    modes = [material.mode for material in shown if material.mode]
    return f"llvm_ad_{modes[0]}" if modes and modes[0] != "rgb" else None


def measurement(measured: Any, model: bool) -> Figure:
    """All that was measured; with the model's own values, if it is a model's and they are asked for."""
    from asperity.goniophotometer import plots

    return plots.figure(measured, measured.about.get("model") if model else None)
