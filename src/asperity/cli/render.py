"""``asperity render``."""

from __future__ import annotations

import re
import time
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from asperity.errors import ParameterError

from . import console, materials, output, passes, scene_files, variants

if TYPE_CHECKING:
    import numpy as np

SIZE, SPP = (512, 512), 64
"""Of a preview: about 20 s of processor time from the prompt to the picture."""

PREVIEW = ("preset", "material", "set", "object", "env", "compare", "crease")
"""Options that make no sense with a scene file."""

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
    crease: Annotated[
        float | None, typer.Option(metavar="DEGREES", help="Smooth the faces of a mesh file that meet at up to this.")
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
    values = (preset, material, settings, object_, env, compare, crease)
    given = {name: value for name, value in zip(PREVIEW, values) if value not in (None, [])}
    if scene and given:
        raise ParameterError(f"--{', --'.join(given)}: a scene file has its own materials, objects and lights.")
    with console.status("loading the scene"):
        variants.choose(variant)
        scenes = [scene_files.load(scene, size)] if scene else previews(given, size or SIZE)
        spp = spp or (scenes[0].sensors()[0].sampler().sample_count() if scene else SPP)
    loaded = time.perf_counter()

    images, done = passes.average(scenes, spp, seed)
    image = beside(*images) if compare else images[0]
    names = scene_files.channel_names(scenes[0], image.shape[-1])
    for file in files:
        output.write(file, image, names)
    rendered = time.perf_counter()
    written = f"{'stopped early: ' if done < spp else ''}{' and '.join(map(str, files))}: {done} samples per pixel"
    times = f"{rendered - start:.1f} s (loading {loaded - start:.1f}, rendering {rendered - loaded:.1f})"
    typer.echo(f"{written}, {times}")
    if not (scene or given):
        typer.echo("\n  ".join(("Try next:", *NEXT)))


def previews(given: dict[str, Any], size: tuple[int, int]) -> list[Any]:
    """The preview scene with the given material, and perhaps the same scene with the one to compare with."""
    shown = [materials.chosen(given.get("preset"), given.get("material"), given.get("set"))]
    if "compare" in given:
        shown.append(materials.chosen(given["compare"], None, None))
    for one in shown:
        materials.check_material(one.material)
    view = shown[0].preview | {name: given[name] for name in ("object", "env", "crease") if name in given}

    import mitsuba as mi

    from asperity.scenes.preview import preview

    with warnings.catch_warnings(record=True) as warned:
        scenes = [mi.load_dict(preview(one.material, size=size, **view), parallel=False) for one in shown]
    for message in dict.fromkeys(str(warning.message) for warning in warned):
        typer.echo(f"warning: {message}", err=True)
    return scenes


def beside(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Both images and their absolute difference, side by side, the difference multiplied so that it can be seen."""
    import numpy as np

    difference = np.abs(a - b)
    # A power of two; the brightest percent may clip, and rounding errors stay dark.
    factor = 2.0 ** np.clip(np.floor(-np.log2(np.quantile(difference, 0.99) + 1e-9)), 0, 8)
    error = difference.mean() / ((a + b).mean() / 2)
    typer.echo(
        f"mean difference: {difference.mean():.3g} or {error:.2%} of the mean; shown times {factor:g}, at the right"
    )
    return np.concatenate([a, b, factor * difference], axis=1)
