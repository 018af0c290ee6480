"""``asperity render``."""

from __future__ import annotations

import re
import time
import warnings
from pathlib import Path
from typing import Annotated, Any

import typer

from asperity.errors import ParameterError
from asperity.materials import Material, resolve

from . import channels, console, materials, output, passes, pictures, scene_files, series, variants

SIZE, SPP = (512, 512), 64
"""Of a preview: about 20 s of processor time from the prompt to the picture."""
MOST = 2**27
"""Pixels: sums of more do not fit into the memory of a desk."""

VIEW = ("object", "env", "light", "floor", "crease")
"""Options that are arguments of `preview.preview`."""
PREVIEW = (*VIEW, "preset", "material", "set", "compare", "turntable", "all", "contact-sheet")
"""Options that make no sense with a scene file."""
ONE = ("preset", "material", "set", "compare", "turntable")
"""Options that make no sense with all presets."""

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
    if not (0 < width <= 2**15 and 0 < height <= 2**15 and width * height <= MOST):
        raise typer.BadParameter(f"{text!r}: expected 512 or 640x360, up to 32768, and {MOST:,} pixels.")
    return width, height


def render(
    ctx: typer.Context,
    target: Annotated[
        str | None, typer.Argument(metavar="MATERIAL", help="A preset, a BSDF, a measurement, JSON; or a scene's file.")
    ] = None,
    preset: materials.PresetName = None,
    material: materials.MaterialFile = None,
    settings: materials.Settings = None,
    object_: Annotated[str | None, typer.Option("--object", help="pawn, knot, sphere, ball, or a mesh file.")] = None,
    env: Annotated[str | None, typer.Option(help="studio, venice, workshop, atelier, sky, constant, or a map.")] = None,
    light: Annotated[
        str | None, typer.Option(help="A lamp in a dim room: key, front (behind the camera), back, side, rim.")
    ] = None,
    floor: Annotated[str | None, typer.Option(help="paper, or tiles.")] = None,
    compare: Annotated[
        str | None, typer.Option(metavar="MATERIAL", help="Show another beside, and the difference.")
    ] = None,
    crease: Annotated[
        float | None, typer.Option(metavar="DEGREES", help="Smooth the faces of a mesh file that meet at up to this.")
    ] = None,
    turntable: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="N pictures of the object as it turns, into a folder.")
    ] = None,
    all_: Annotated[bool, typer.Option("--all", help="All presets, into a folder; those there are kept.")] = False,
    contact_sheet: Annotated[bool, typer.Option("--contact-sheet", help="With --all: and all on one picture.")] = False,
    denoise: Annotated[
        bool | None,
        typer.Option("--denoise/--no-denoise", help="Default: the PNG of a preview, if pyoidn is there."),
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
        Path | None,
        typer.Option("--out", "-o", help="PNG or EXR; both, if it has no ending; a folder, for several pictures."),
    ] = None,
    force: output.Force = False,
) -> None:
    """Render a material on the preview scene, or a scene file, XML or JSON, to a PNG and an EXR.

    The PNG of a preview is denoised, if pyoidn is there; an EXR holds what was rendered, to measure with, and after it
    the denoised colours if --denoise is given. The exit code is 1 if there are pixels that are not finite.
    """
    values = (object_, env, light, floor, crease, preset, material, settings, compare, turntable, all_, contact_sheet)
    given = {name: value for name, value in zip(PREVIEW, values) if value not in (None, [], False)}
    scene = Path(target) if target and Path(target).suffix.lower() in scene_files.FORMATS else None
    if target and not scene:
        if preset or material:
            raise ParameterError(f"{target!r}, --preset, --material: give one of them.")
        given["preset"] = target
    if scene and given:
        raise ParameterError(f"--{', --'.join(given)}: a scene file has its own materials, objects and lights.")
    if not scene and (sensor or define):
        raise ParameterError("--sensor, --define: they are for scene files.")
    quality = pictures.Quality(size, spp, seed, sensor, denoise)
    if turntable or all_ or contact_sheet:
        check_several(given)
        default = Path("presets" if all_ else "turntable")
        folder = ctx.with_resource(output.folder(out, default, force=force or all_))
        several(ctx, folder, given, quality, variant, again=force or not all_)
        return
    inputs = (scene, target, material, env and Path(env), object_ and Path(object_), *(settings or []), *(define or []))
    files = ctx.with_resource(output.files(out, output.NAME, output.FORMATS, force=force, inputs=inputs))
    single(ctx, files, scene, given, quality, variant, define or [])
    if not (scene or given):
        typer.echo("\n  ".join(("Try next:", *NEXT)))


def check_several(given: dict[str, Any]) -> None:
    """Raise ParameterError if the options for several pictures are at odds."""
    if "all" not in given and "contact-sheet" in given:
        raise ParameterError("--contact-sheet: it is for --all.")
    if "all" in given and (wrong := [name for name in ONE if name in given]):
        raise ParameterError(f"--{', --'.join(wrong)}: not with --all, which renders each preset.")
    if "compare" in given:
        raise ParameterError("--compare: not with --turntable.")


def single(
    ctx: typer.Context,
    files: list[Path],
    scene: Path | None,
    given: dict[str, Any],
    quality: pictures.Quality,
    variant: str | None,
    define: list[str],
) -> None:
    """One picture, perhaps with another and the difference beside."""
    start, sensor = time.perf_counter(), quality.sensor
    with console.status("loading the scene"):
        variants.choose(variant)
        if scene:
            scenes = [scene_files.load(scene, quality.size, sensor, scene_files.parse_defines(define))]
        else:
            shown = [materials.chosen(given.get("preset"), given.get("material"), given.get("set"))]
            shown += [resolve(given["compare"])] if "compare" in given else []
            scenes = previews(shown, shown[0].preview | view(given), quality)
        channels.check(scenes[0], sensor, {file.suffix.lower() for file in files})
        denoise = scene is None and any(file.suffix.lower() == ".png" for file in files)
        settled = quality.settled(scenes[0], denoise=denoise)
    loaded = time.perf_counter()

    found = pictures.paint(scenes, settled, ctx.with_resource(passes.interruptible()))
    picture = beside(*found) if len(found) > 1 else found[0]
    for file in files:
        output.write(file, *picture.channels(file.suffix.lower(), layers=bool(quality.denoise)))
    rendered = time.perf_counter()
    early = "stopped early: " if picture.samples < settled.spp else ""
    times = f"{rendered - start:.1f} s (loading {loaded - start:.1f}, rendering {rendered - loaded:.1f})"
    typer.echo(f"{early}{' and '.join(map(str, files))}: {picture.samples} samples per pixel, {times}")
    if faults := [fault for one in found if (fault := channels.fault(one.image))]:
        typer.echo("\n".join(f"warning: {fault}" for fault in faults), err=True)
        raise typer.Exit(1)


def several(
    ctx: typer.Context,
    folder: Path,
    given: dict[str, Any],
    quality: pictures.Quality,
    variant: str | None,
    *,
    again: bool,
) -> None:
    """A picture of each preset, or of each frame of a turn."""
    variants.choose(variant)
    if "all" in given:
        jobs = series.every(view(given))
    else:
        material = materials.chosen(given.get("preset"), given.get("material"), given.get("set"))
        jobs = series.turning(material, view(given), given["turntable"])
    interrupted = ctx.with_resource(passes.interruptible())

    def paint(material: Material, view: dict[str, Any]) -> tuple[pictures.Picture, bool]:
        with console.status("loading the scene"):
            scenes = previews([material], view, quality)
        settled = quality.settled(scenes[0], denoise=True)
        [picture] = pictures.paint(scenes, settled, interrupted)
        return picture, picture.samples >= settled.spp

    if not series.write(jobs, folder, paint, again=again, sheet="contact-sheet" in given, interrupted=interrupted):
        raise typer.Exit(1)


def view(given: dict[str, Any]) -> dict[str, Any]:
    """How to look at a material, as far as options say it."""
    return {name: given[name] for name in VIEW if name in given}


def previews(shown: list[Material], view: dict[str, Any], quality: pictures.Quality) -> list[Any]:
    """The same preview scene with each of these materials."""
    bsdfs = [one.load() for one in shown]

    import mitsuba as mi

    from asperity.scenes.preview import preview

    size = quality.size or SIZE
    with warnings.catch_warnings(record=True) as warned:
        scenes = [
            mi.load_dict(preview(one.description or bsdf, size=size, spp=SPP, **view), parallel=False)
            for one, bsdf in zip(shown, bsdfs)
        ]
    for message in dict.fromkeys(str(warning.message) for warning in warned):
        typer.echo(f"warning: {message}", err=True)
    return scenes


def beside(a: pictures.Picture, b: pictures.Picture) -> pictures.Picture:
    """Both pictures and their absolute difference, side by side, the difference multiplied so that it can be seen.

    The numbers are those of what was rendered, before it was denoised.
    """
    import numpy as np

    with np.errstate(invalid="ignore"):  # both may be infinite
        difference = np.abs(a.image - b.image)
    sound = np.isfinite(difference)
    seen, total = difference[sound] if sound.any() else np.zeros(1), (a.image + b.image)[sound].sum()
    # A power of two; the brightest percent may clip, and rounding errors stay dark.
    factor = 2.0 ** np.clip(np.floor(-np.log2(np.quantile(seen, 0.99) + 1e-9)), 0, 8)
    error = 2 * seen.sum() / total if total else 0
    typer.echo(f"mean difference: {seen.mean():.3g} or {error:.2%} of the mean; shown times {factor:g}, at the right")
    image = np.concatenate([a.image, b.image, factor * difference], axis=1)
    if a.shown is a.image:
        return a._replace(image=image, shown=image)
    return a._replace(image=image, shown=np.concatenate([a.shown, b.shown, factor * np.abs(a.shown - b.shown)], axis=1))
