"""``asperity render``."""

from __future__ import annotations

import re
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from asperity.errors import ParameterError

from . import console, materials, output, passes, scene_files, variants

if TYPE_CHECKING:
    import numpy as np

SIZE, SPP = (640, 640), 64
"""Of a preview: half a minute from the prompt to the picture on two cores."""

NEXT = (
    "asperity list",
    "asperity render --preset gilded --object knot --env venice",
    "asperity render --preset gold-dust --set tau_0=0.7 --compare gold-dust",
    "asperity show micrograin",
)


def parse_size(text: str) -> tuple[int, int]:
    """Width and height from ``512`` or ``640x360``."""
    numbers = re.fullmatch(r"(\d+)(?:x(\d+))?", text)
    width, height = (int(numbers[1]), int(numbers[2] or numbers[1])) if numbers else (0, 0)
    if not (0 < width <= 2**15 and 0 < height <= 2**15):
        raise typer.BadParameter(f"{text!r}: expected 512 or 640x360, up to 32768.")
    return width, height


def render(
    scene: Annotated[Path | None, typer.Argument(metavar="SCENE", help="A whole scene, XML or JSON.")] = None,
    preset: materials.PresetName = None,
    material: materials.MaterialFile = None,
    settings: materials.Settings = None,
    object_: Annotated[str | None, typer.Option("--object", help="pawn, knot, sphere, or a mesh file.")] = None,
    env: Annotated[str | None, typer.Option(help="studio, venice, workshop, sky, constant, or a map.")] = None,
    compare: Annotated[
        str | None, typer.Option(metavar="PRESET", help="Show another beside, and the difference.")
    ] = None,
    size: Annotated[Any, typer.Option(parser=parse_size, metavar="SIZE", help="512, or 640x360.")] = None,
    spp: Annotated[int | None, typer.Option(min=1, help="Samples per pixel.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Another seed, another noise.")] = 0,
    variant: variants.Variant = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="PNG or EXR; both, if it has no ending.")] = output.NAME,
) -> None:
    """Render a material on the preview scene, or a scene file, to a PNG and an EXR."""
    start = time.perf_counter()
    files = output.targets(out)
    options = {
        "preset": preset,
        "material": material,
        "set": settings,
        "object": object_,
        "env": env,
        "compare": compare,
    }
    given = [f"--{name}" for name, value in options.items() if value]
    if scene and given:
        raise ParameterError(f"{', '.join(given)}: a scene file has its own materials, objects and lights.")
    with console.stderr().status("loading the scene"):
        variants.choose(variant)
        if scene:
            scenes = [scene_files.load(scene, size)]
            spp = spp or scenes[0].sensors()[0].sampler().sample_count()
        else:
            scenes, spp = previews(preset, material, settings, compare, object_, env, size or SIZE), spp or SPP
    loaded = time.perf_counter()

    images, done = passes.average(scenes, spp, seed)
    image = beside(*images) if compare else images[0]
    for file in files:
        output.write(file, image, scenes[0].integrator().aov_names())
    rendered = time.perf_counter()
    typer.echo(
        f"{'stopped early: ' if done < spp else ''}{' and '.join(map(str, files))}: {done} samples per pixel, ",
        nl=False,
    )
    typer.echo(f"{rendered - start:.1f} s (loading {loaded - start:.1f}, rendering {rendered - loaded:.1f})")
    if not (scene or given):
        typer.echo("\n  ".join(("Try next:", *NEXT)))


def previews(
    preset: str | None,
    material: Path | None,
    settings: list[str] | None,
    compare: str | None,
    object_: str | None,
    env: str | None,
    size: tuple[int, int],
) -> list[Any]:
    """The preview scene with the chosen material, and the same scene with the one to compare with."""
    first = materials.chosen(preset, material, settings)
    shown = [first, *([materials.chosen(compare, None, None)] if compare else [])]
    view = first.preview | {name: value for name, value in (("object", object_), ("env", env)) if value}
    for one in shown:
        materials.check_material(one.material)

    import mitsuba as mi

    from asperity.scenes.preview import preview

    return [mi.load_dict(preview(one.material, size=size, **view), parallel=False) for one in shown]


def beside(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Both images and their absolute difference, side by side, the difference multiplied so that it can be seen."""
    import numpy as np

    difference = np.abs(a - b)
    # A power of two; the brightest percent may clip.
    brightest = np.quantile(difference, 0.99)
    factor = 2.0 ** max(0, np.floor(-np.log2(brightest))) if brightest else 1.0
    error = difference.mean() / ((a + b).mean() / 2)
    typer.echo(
        f"mean difference: {difference.mean():.3g} or {error:.2%} of the mean; shown times {factor:g}, at the right"
    )
    return np.concatenate([a, b, factor * difference], axis=1)
