"""The preview scene: an object of some material on a plain ground, under an environment; made by code."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from asperity import loading
from asperity.errors import ParameterError, UnknownNameError, UnreadableFileError, readable
from asperity.scenes import meshes
from asperity.scenes.objects import OBJECTS

Description = dict[str, Any]
Map = NDArray[np.floating]

MAP_FORMATS = (".exr", ".hdr")
WHITE = 0.75
"""Radiance of white paper on the ground, to which every environment is exposed; below 1, for the highlights."""


class Lighting(NamedTuple):
    """How a map of ours is used: its turn in degrees, counterclockwise, and the power its radiance is raised to."""

    azimuth: float
    contrast: float


# The main light comes from the front left. Less contrast shows the dark rooms, and tames the fireflies of tiny lamps.
MAPS = {"studio": Lighting(-150, 0.65), "venice": Lighting(-85, 1), "workshop": Lighting(0, 0.8)}
ENVIRONMENTS = (*MAPS, "sky", "constant")

GROUND_RADIUS = 60.0


def preview(
    material: Description,
    *,
    object: str | Path = "pawn",
    env: str | Path = "studio",
    size: tuple[int, int] = (768, 768),
    spp: int = 64,
    seed: int = 0,
    integrator: Description | None = None,
    crease: float | None = None,
) -> Description:
    """Description, for the current variant, of a scene that shows ``material`` on an object.

    ``object`` is one of OBJECTS or a mesh file; ``env`` one of ENVIRONMENTS or an environment map. A file's
    light is exposed but keeps its colour, and z is up. ``integrator`` replaces the path tracer. ``crease`` is the angle
    in degrees up to which the faces of a mesh file are smoothed; see `meshes.from_file`.
    """
    return {
        "type": "scene",
        # Sixteen interfaces: light that enters a glass stem by the ground has to find its way out of the head.
        "integrator": integrator or {"type": "path", "max_depth": 16, "rr_depth": 8},
        "sensor": camera(size, spp, seed),
        "ground": ground(),
        "environment": environment(env),
        "object": shown(object, material, crease),
    }


def shown(name: str | Path, material: Description, crease: float | None = None) -> Any:
    """The object, as a shape."""
    if isinstance(name, str) and name in OBJECTS:
        if crease is not None:
            raise ParameterError(f"crease = {crease}: the {name} has normals of its own. It is for mesh files.")
        return meshes.to_mitsuba(OBJECTS[name](), material)
    if isinstance(name, (str, Path)) and Path(name).suffix:
        return meshes.to_mitsuba(meshes.from_file(name, crease), material)
    raise UnknownNameError("object", str(name), [*OBJECTS, *(f"FILE{suffix}" for suffix in meshes.FORMATS)])


def camera(size: tuple[int, int], spp: int, seed: int) -> Description:
    """A long lens, a little above the object: the ground fills the picture behind it."""
    width, height = size
    return {
        "type": "perspective",
        "fov": 18.5,
        "fov_axis": "smaller",
        "to_world": mi.ScalarTransform4f().look_at(origin=[0, -8.6, 3.2], target=[0, 0, 1.02], up=[0, 0, 1]),
        "film": {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "gaussian"}},
        "sampler": {"type": "multijitter", "sample_count": spp, "seed": seed},
    }


def ground() -> Description:
    """A disk of matte paper, lit in the middle and darker towards its edge, which is beyond the picture."""
    distance = np.linspace(0, GROUND_RADIUS, 128, dtype=np.float32)
    grey = 0.18 + 0.4 / (1 + (distance / 9) ** 2)
    return {
        "type": "disk",
        "to_world": mi.ScalarTransform4f().scale(GROUND_RADIUS),
        "bsdf": {
            "type": "diffuse",
            # The disk's own coordinates are (radius, azimuth): one row of pixels makes a radial gradient.
            "reflectance": {
                "type": "bitmap",
                "bitmap": mi.Bitmap(grey[None, :, None]),
                "raw": True,
                "wrap_mode": "clamp",
            },
        },
    }


def environment(name: str | Path) -> Description:
    """The light around the object."""
    if name == "constant":
        return {"type": "constant", "radiance": {"type": "rgb", "value": WHITE}}
    if name == "sky":
        return sky()
    if isinstance(name, str) and name in MAPS:
        azimuth, contrast = MAPS[name]
        radiance = read_map(Path(__file__).with_name("environments") / f"{name}.exr") ** contrast
        return lit_by(radiance / irradiance(radiance), azimuth)  # per channel: a white balance
    if isinstance(name, (str, Path)) and Path(name).suffix:
        return lit_by(read_map(Path(name)))
    raise UnknownNameError("environment", str(name), [*ENVIRONMENTS, *(f"FILE{suffix}" for suffix in MAP_FORMATS)])


def sky() -> Description:
    """A clear afternoon, the sun at the front left."""
    exposure = 3.2 * WHITE  # measured on white paper
    return {
        "type": "sunsky",
        "sun_direction": [-0.6, -0.5, 0.62],
        "sun_scale": exposure,
        "sky_scale": exposure,
        # Twice the real sun, for a softer shadow; from 2 degrees on, Mitsuba's sampling of it becomes noisy.
        "sun_aperture": 1.0,
    }


def read_map(path: Path) -> Map:
    """Radiance (height, width, 3) of an environment map in longitude and latitude."""
    what = "environment map"
    readable(what, path, MAP_FORMATS)
    bitmap = loading.image(path)
    try:
        bitmap = bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False)
    except RuntimeError as error:
        raise UnreadableFileError(what, path, MAP_FORMATS, str(error)) from error
    radiance = np.maximum(np.array(bitmap), 0)  # filters that resize maps ring below zero
    if not 0 < irradiance(radiance).sum() < np.inf:
        raise UnreadableFileError(what, path, MAP_FORMATS, "it has no light, or not finite, above its horizon")
    return radiance


def lit_by(radiance: Map, azimuth: float = 0.0) -> Description:
    """A map, z up, turned counterclockwise by ``azimuth`` degrees, and exposed."""
    exposed = radiance * (np.pi * WHITE / irradiance(radiance).mean())
    # The ground hides the lower half, save where it ends: no light samples are wasted on it.
    height = len(exposed)
    exposed[height // 2 + height // 32 :] = 0
    return {
        "type": "envmap",
        "bitmap": mi.Bitmap(exposed.astype(np.float32)),
        "to_world": mi.ScalarTransform4f().rotate([0, 0, 1], azimuth).rotate([1, 0, 0], 90),
    }


def irradiance(radiance: Map) -> Map:
    """Irradiance (3,) of the ground under a map."""
    height, width, _ = radiance.shape
    zenith_angle = (np.arange(height) + 0.5) / height * np.pi
    projected = np.clip(np.cos(zenith_angle), 0, None) * np.sin(zenith_angle) * (np.pi / height) * (2 * np.pi / width)
    return np.einsum("hwc,h->c", radiance, projected)
