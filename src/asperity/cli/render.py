"""``asperity render``."""

from __future__ import annotations

import re
import time
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from asperity.errors import ParameterError
from asperity.materials import resolve

from . import channels, console, materials, output, passes, scene_files, variants

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
    ctx: typer.Context,
    scene: Annotated[Path | None, typer.Argument(metavar="SCENE", help="A whole scene, XML or JSON.")] = None,
    preset: materials.PresetName = None,
    material: materials.MaterialFile = None,
    settings: materials.Settings = None,
    object_: Annotated[str | None, typer.Option("--object", help="pawn, knot, sphere, or a mesh file.")] = None,
    env: Annotated[str | None, typer.Option(help="studio, venice, workshop, sky, constant, or a map.")] = None,
    compare: Annotated[
        str | None, typer.Option(metavar="MATERIAL", help="Show another beside, and the difference.")
    ] = None,
    crease: Annotated[
        float | None, typer.Option(metavar="DEGREES", help="Smooth the faces of a mesh file that meet at up to this.")
    ] = None,
    size: Annotated[Any, typer.Option(parser=parse_size, metavar="SIZE", help="512, or 640x360.")] = None,
    spp: Annotated[int | None, typer.Option(min=1, help="Samples per pixel.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Another seed, another noise.")] = 0,
    sensor: Annotated[int, typer.Option("--sensor", "-s", min=0, help="Of a scene with several; counted from 0.")] = 0,
    define: Annotated[
        list[str] | None, typer.Option("--define", "-D", metavar="NAME=VALUE", help="For $NAME in a scene. Repeatable.")
    ] = None,
    variant: variants.Variant = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="PNG or EXR; both, if it has no ending. Default: a new asperity.")
    ] = None,
    force: output.Force = False,
) -> None:
    """Render a material on the preview scene, or a scene file, to a PNG and an EXR.

    The exit code is 1 if the picture has pixels that are not finite.
    """
    start = time.perf_counter()
    inputs = (scene, material, env and Path(env), object_ and Path(object_), *(settings or []), *(define or []))
    files = ctx.with_resource(output.files(out, output.NAME, output.FORMATS, force=force, inputs=inputs))
    values = (preset, material, settings, object_, env, compare, crease)
    given = {name: value for name, value in zip(PREVIEW, values) if value not in (None, [])}
    if scene and given:
        raise ParameterError(f"--{', --'.join(given)}: a scene file has its own materials, objects and lights.")
    if not scene and (sensor or define):
        raise ParameterError("--sensor, --define: they are for scene files.")
    with console.status("loading the scene"):
        variants.choose(variant)
        if scene:
            scenes = [scene_files.load(scene, size, sensor, scene_files.parse_defines(define or []))]
        else:
            scenes = previews(given, size or SIZE)
        channels.check(scenes[0], sensor, {file.suffix.lower() for file in files})
        spp = spp or (scenes[0].sensors()[sensor].sampler().sample_count() if scene else SPP)
    loaded = time.perf_counter()

    images, done = passes.average(scenes, spp, seed, sensor, ctx.with_resource(passes.interruptible()))
    image = beside(*images) if compare else images[0]
    names = channels.names(scenes[0], image.shape[-1], sensor)
    for file in files:
        output.write(file, image, names)
    rendered = time.perf_counter()
    written = f"{'stopped early: ' if done < spp else ''}{' and '.join(map(str, files))}: {done} samples per pixel"
    times = f"{rendered - start:.1f} s (loading {loaded - start:.1f}, rendering {rendered - loaded:.1f})"
    typer.echo(f"{written}, {times}")
    if faults := [fault for one in images if (fault := channels.fault(one))]:
        typer.echo("\n".join(f"warning: {fault}" for fault in faults), err=True)
        raise typer.Exit(1)
    if not (scene or given):
        typer.echo("\n  ".join(("Try next:", *NEXT)))


def previews(given: dict[str, Any], size: tuple[int, int]) -> list[Any]:
    """The preview scene with the given material, and perhaps the same scene with the one to compare with."""
    shown = [materials.chosen(given.get("preset"), given.get("material"), given.get("set"))]
    if "compare" in given:
        shown.append(resolve(given["compare"]))
    bsdfs = [one.load() for one in shown]
    view = shown[0].preview | {name: given[name] for name in ("object", "env", "crease") if name in given}

    import mitsuba as mi

    from asperity.scenes.preview import preview

    with warnings.catch_warnings(record=True) as warned:
        scenes = [
            mi.load_dict(preview(one.description or bsdf, size=size, **view), parallel=False)
            for one, bsdf in zip(shown, bsdfs)
        ]
    for message in dict.fromkeys(str(warning.message) for warning in warned):
        typer.echo(f"warning: {message}", err=True)
    return scenes


def beside(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Both images and their absolute difference, side by side, the difference multiplied so that it can be seen."""
    import numpy as np

    with np.errstate(invalid="ignore"):  # both may be infinite
        difference = np.abs(a - b)
    sound = np.isfinite(difference)
    seen, total = difference[sound] if sound.any() else np.zeros(1), (a + b)[sound].sum()
    # A power of two; the brightest percent may clip, and rounding errors stay dark.
    factor = 2.0 ** np.clip(np.floor(-np.log2(np.quantile(seen, 0.99) + 1e-9)), 0, 8)
    error = 2 * seen.sum() / total if total else 0
    typer.echo(f"mean difference: {seen.mean():.3g} or {error:.2%} of the mean; shown times {factor:g}, at the right")
    return np.concatenate([a, b, factor * difference], axis=1)
