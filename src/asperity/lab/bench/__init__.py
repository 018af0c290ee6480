"""What a BSDF costs beside another: time, noise and memory, of any materials that Mitsuba can load.

The materials of a group take turns, so that all meet the same noise of the machine. Of all rounds the quartiles count,
of times and of their ratios to the reference's in the same round.

Every BSDF that is alive makes all frames longer, since Dr.Jit records all that a pointer may mean: fifty make that of
`roughconductor` three times as long, the dozen of a group a tenth, and ratios come nearer to 1. So groups are small,
and each scene is measured by itself.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from ... import llvm, loading
from .. import evaluate
from .first import First, first_picture
from .scenes import scenes
from .timing import finish, quartiles, turns

Description = dict[str, Any]
Row = dict[str, Any]
CALLS = "eval_pdf", "sample"
LEAST = 1e-20
"""What numbers that may be zero are divided by, at least: radiance of black materials, memory that nobody tells."""
FRAMES = "bare", "preview", "filled", "point"


class Effort(NamedTuple):
    """Side of frames and samples per pixel, rounds, directions of a call, and rounds of first pictures."""

    size: int
    spp: int
    rounds: int
    lanes: int
    fresh: int


FULL, QUICK = Effort(160, 16, 5, 1 << 21, 2), Effort(96, 8, 3, 1 << 19, 1)


def measure(
    materials: Mapping[str, Description], effort: Effort = FULL, tick: Callable[..., None] = lambda *_: None
) -> dict[str, Row]:
    """By material and column, what it costs; the first material is the reference of all ratios.

    All columns have ``time`` and ``ratio``: quartiles in seconds, of calls in nanoseconds for each lane, and of the
    ratio to the reference. Those of frames have ``variance``, of a pixel at one sample over its mean squared, and
    ``noise`` and ``work``, the ratios of variance, and of variance times time. ``first`` is the time to the first
    picture in a new process, and ``memory`` the most that it took, in MiB (``value`` and ``ratio``).

    ``tick(column)`` is called after each task; what it raises ends it.
    Raises ParameterError in variants without arrays.
    """
    evaluate.require_arrays("timing")
    reference = next(iter(materials))
    rows: dict[str, Row] = {name: {"against": reference} for name in materials}
    for column, tasks in calls(materials, effort.lanes).items():
        seconds, _ = turns(tasks, effort.rounds, partial(tick, column))
        for name, times in seconds.items():
            rows[name][column] = timed(1e9 / effort.lanes * times, 1e9 / effort.lanes * seconds[reference])
    for column, scene in scenes(effort.size, effort.spp).items():
        tasks = {name: frame(scene(material)) for name, material in materials.items()}
        # One more frame than times, for the noise is that of two.
        seconds, images = turns(tasks, effort.rounds + 1, partial(tick, column))
        spp = effort.spp * (4 if column == "bare" else 1)
        noise = {name: spp * relative_variance(pictures) for name, pictures in images.items()}
        for name, times in seconds.items():
            ratio = noise[name] / np.maximum(noise[reference], LEAST)
            rows[name][column] = timed(times, seconds[reference]) | {
                "variance": quartiles(noise[name]),
                "noise": quartiles(ratio),
                "work": quartiles(ratio * (times / seconds[reference])[1:]),
            }
    firsts: dict[str, list[First]] = {name: [] for name in materials}
    for _ in range(effort.fresh):
        for name, material in materials.items():
            firsts[name].append(first_picture(material, str(mi.variant())))
            tick("first")
    for name in materials:
        (wall, _, memory), (wall_of, _, memory_of) = (np.array(firsts[one]).T for one in (name, reference))
        rows[name]["first"] = timed(wall, wall_of)
        rows[name]["memory"] = {"value": quartiles(memory), "ratio": quartiles(memory / np.maximum(memory_of, LEAST))}
    return rows


def steps(materials: Mapping[str, Description], effort: Effort) -> int:
    """How often ``tick`` is called."""
    each = len(CALLS) * (effort.rounds + 1) + len(FRAMES) * (effort.rounds + 2) + effort.fresh
    return each * len(materials)


def calls(materials: Mapping[str, Description], lanes: int) -> dict[str, dict[str, Callable[[], Any]]]:
    """For `CALLS`, what calls it at so many random directions, for each material."""
    rng, ctx = mi.PCG32(size=lanes), mi.BSDFContext()
    wi, wo = (mi.warp.square_to_cosine_hemisphere(mi.Point2f(rng.next_float32(), rng.next_float32())) for _ in range(2))
    u, v = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    dr.eval(wi, wo, u, v)
    si = dr.zeros(mi.SurfaceInteraction3f, lanes)
    si.wi = wi

    bsdfs = {name: loading.load(material) for name, material in materials.items()}

    def eval_pdf(bsdf: Any) -> None:
        finish(bsdf.eval_pdf(ctx, si, wo))

    def sample(bsdf: Any) -> None:
        finish(bsdf.sample(ctx, si, u, v))

    return {call.__name__: {name: partial(call, bsdf) for name, bsdf in bsdfs.items()} for call in (eval_pdf, sample)}


def frame(description: Description) -> Callable[[], Any]:
    """What renders it once more, with other random numbers."""
    scene, seed = mi.load_dict(description, parallel=False), iter(range(1 << 20))
    return lambda: finish(mi.render(scene, seed=next(seed)))


def relative_variance(pictures: list[Any]) -> np.ndarray:
    """Of pictures of the same with other random numbers, by pairs of successive ones: variance over squared mean."""
    images = np.array([np.asarray(picture, dtype=float)[..., :3] for picture in pictures])
    return (
        np.square(np.diff(images, axis=0)).mean(axis=(1, 2, 3)) / 2 / max(np.square(images.mean(axis=0)).mean(), LEAST)
    )


def timed(times: np.ndarray, reference: np.ndarray) -> dict[str, list[float]]:
    """A time, and its ratio round by round."""
    return {"time": quartiles(times), "ratio": quartiles(times / reference)}


def circumstances() -> dict[str, Any]:
    """On which machine, and with what; the load before, for a busy machine's numbers are worth less."""
    return {
        "machine": processor(),
        "threads": dr.thread_count(),
        "load": os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0,
        "variant": mi.variant(),
        "python": platform.python_version(),
        "mitsuba": mi.__version__,
        "drjit": dr.__version__,
        "llvm": ".".join(map(str, llvm.loaded_version() or ())),
    }


def processor() -> str:
    """Its name, as far as the system tells."""
    try:
        with open("/proc/cpuinfo") as file:
            return next(line.split(":")[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
