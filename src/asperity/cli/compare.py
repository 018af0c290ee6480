"""``asperity compare``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from asperity.materials import resolve

from . import channels, console, materials, output, passes, plot, variants

if TYPE_CHECKING:
    import numpy as np

    from asperity.drawing.comparison import Previews
    from asperity.lab.compare import Comparison
    from asperity.materials import Material

SIZE, SPP = 256, 64
"""Of the previews."""
NO_FLIP = "no FLIP, only the plain difference: `python -m pip install 'asperity[flip]'` adds it."


def compare(
    ctx: typer.Context,
    first: Annotated[str, typer.Argument(metavar="A", help="The reference: a preset, a BSDF, a file, JSON.")],
    second: Annotated[str, typer.Argument(metavar="B", help="What to compare with it.")],
    settings: materials.Settings = None,
    preview: Annotated[bool, typer.Option(help="Render both.")] = True,
    json_: Annotated[bool, typer.Option("--json", help="Print the numbers as JSON.")] = False,
    variant: variants.Variant = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="PNG, PDF or SVG. Default: A-B.png.")] = None,
    force: output.Force = False,
) -> None:
    """Compare two materials: numbers, and a figure of maps, slices, albedos, and previews.

    --set changes the second.
    """
    stems = [plot.default_path(one, None).stem for one in (first, second)]
    inputs = [*(one if plot.is_text(one) else Path(one) for one in (first, second)), *(settings or [])]
    default = Path(f"{'-'.join(stems)}.png")
    [path] = ctx.with_resource(output.files(out, default, plot.FORMATS, force=force, inputs=inputs))
    with console.status("comparing"):
        shown = resolve(first), resolve(second, settings or [])
        variants.choose(variant or plot.suited(shown))
        from asperity import drawing
        from asperity.drawing import comparison

        names = drawing.distinct_names(shown)
        found = comparison.compare(*shown, names)
    rendered = previews(*shown) if preview else None
    with console.status("drawing"):
        drawing.style.save(drawing.compared(*shown, found, rendered), path)
    numbers = found.numbers() | means(rendered)
    if json_:
        typer.echo(json.dumps({"a": names[0], "b": names[1], **numbers}, indent=2))
    else:
        report(names, found, numbers)
        typer.echo(path)
    if rendered is not None and rendered.flip is None:
        console.note(NO_FLIP)


def means(rendered: Previews | None) -> dict[str, float]:
    """Mean differences of the previews."""
    if rendered is None:
        return {}
    found = {"preview_difference": float(rendered.difference.mean())}
    return found if rendered.flip is None else found | {"preview_flip": float(rendered.flip.mean())}


def report(names: list[str], found: Comparison, numbers: dict[str, Any]) -> None:
    """Print the table."""

    def share(x: float | None) -> str:
        return "infinite" if x is None else f"{x:.2%}" if abs(x) < 10 else f"{x:.3g}"

    worst = found.worst
    where = "θ_i = {:.0f}°, φ_i = {:.0f}°; θ_o = {:.1f}°, φ_o = {:.1f}°".format(*worst.incident, *worst.outgoing)
    at = numbers["albedo_largest_difference_theta"]
    table = Table(f"{names[1]} against {names[0]}", "", "where")
    over = "all directions, by solid angle" if found.error is None else "all that was measured"
    table.add_row("mean relative error", share(numbers["mean_relative_error"]), over)
    if numbers["of_it_noise"] is not None:
        table.add_row("of it, noise", share(numbers["of_it_noise"]), "of what was measured")
    table.add_row("worst relative error", share(numbers["worst_relative_error"]), where)
    table.add_row("log-cosine error, RMS", f"{numbers['log_cosine_rms']:.4g}", "as Löw et al. 2012")
    table.add_row("albedo, largest difference", f"{numbers['albedo_largest_difference']:+.4f}", f"θ_i = {at:g}°")
    if "preview_difference" in numbers:
        table.add_row("preview, mean difference", f"{numbers['preview_difference']:.4f}", "sRGB")
    if "preview_flip" in numbers:
        table.add_row("preview, mean FLIP", f"{numbers['preview_flip']:.4f}", "67 pixels a degree")
    console.stdout().print(table)


def previews(first: Material, second: Material) -> Previews:
    """Both in the preview scene of the first, their mean absolute difference over channels, and FLIP's map."""
    import mitsuba as mi
    import numpy as np

    from asperity.drawing.comparison import Previews
    from asperity.scenes.preview import preview

    shown = [one.description or one.load() for one in (first, second)]
    scenes = [mi.load_dict(preview(one, size=(SIZE, SIZE), spp=SPP, **first.preview), parallel=False) for one in shown]
    images, _ = passes.average(scenes, SPP, seed=0)
    names = channels.names(scenes[0], images[0].shape[-1])
    a, b = (np.asarray(channels.png(image.astype(np.float32), names))[..., :3] / 255.0 for image in images)
    return Previews(a, b, np.abs(a - b).mean(axis=-1), flip(a, b))


def flip(reference: np.ndarray, test: np.ndarray) -> np.ndarray | None:
    """FLIP's map (height, width) of two pictures in sRGB (Andersson et al. 2020); None without its package."""
    try:
        import flip_evaluator
    except ImportError:
        return None
    import numpy as np

    images = [np.ascontiguousarray(image, dtype=np.float32) for image in (reference, test)]
    error, _, _ = flip_evaluator.evaluate(*images, "LDR", applyMagma=False, computeMeanError=False)
    return np.asarray(error).reshape(error.shape[:2])
