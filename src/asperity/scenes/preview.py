"""The preview scene: an object of some material on a floor, under an environment or a lamp; made by code."""

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
ENVIRONMENTS = (*MAPS, "atelier", "sky", "constant")

LIGHTS: dict[str, list[tuple[float, float, float]]] = {
    "key": [(-0.6, -0.65, 0.65)],
    "front": [(0, -0.97, 0.25)],
    "back": [(0.1, 0.9, 0.42)],
    "side": [(-1, -0.05, 0.25)],
    "rim": [(-0.7, 0.7, 0.3), (0.7, 0.7, 0.3)],
}
"""Where lamps are, seen from the object; the camera is in front, towards -y."""
LAMP_DISTANCE, LAMP_RADIUS = 40.0, 4.0
"""A disc of 6 degrees about its middle: its shadows are soft."""
ROOM = 0.12
"""What is left of the environment where there is a lamp."""

GROUND_RADIUS = 60.0
FLOORS = ("paper", "tiles")
TILED, TILE = 10.0, 0.9
"""Half the width of the tiled part of the floor, and the width of a tile."""


def preview(
    material: Description,
    *,
    object: str | Path = "pawn",
    env: str | Path = "studio",
    light: str | None = None,
    floor: str = "paper",
    size: tuple[int, int] = (768, 768),
    spp: int = 64,
    seed: int = 0,
    integrator: Description | None = None,
    crease: float | None = None,
    turn: float = 0.0,
) -> Description:
    """Description, for the current variant, of a scene that shows ``material`` on an object.

    ``object`` is one of OBJECTS or a mesh file; ``env`` one of ENVIRONMENTS or an environment map. A file's
    light is exposed but keeps its colour, and z is up. ``light``, one of LIGHTS, dims it and puts lamps there: from
    the front means from behind the camera. ``floor`` is one of FLOORS. ``integrator`` replaces the path tracer.
    ``crease`` is the angle in degrees up to which the faces of a mesh file are smoothed; see `meshes.from_file`.
    ``turn``, in degrees, turns the object counterclockwise, seen from above.
    """
    return {
        "type": "scene",
        # Sixteen interfaces: light that enters a glass stem by the ground has to find its way out of the head.
        "integrator": integrator or {"type": "path", "max_depth": 16, "rr_depth": 8},
        "sensor": camera(size, spp, seed),
        "ground": ground(floor),
        "environment": environment(env, 1.0 if light is None else ROOM),
        **lamps(light),
        "object": shown(object, material, crease, turn),
    }


def shown(name: str | Path, material: Description | mi.BSDF, crease: float | None = None, turn: float = 0.0) -> Any:
    """The object, as a shape."""
    if isinstance(name, str) and name in OBJECTS:
        if crease is not None:
            raise ParameterError(f"crease = {crease}: the {name} has normals of its own. It is for mesh files.")
        mesh = OBJECTS[name]()
    elif isinstance(name, (str, Path)) and Path(name).suffix:
        mesh = meshes.from_file(name, crease)
    else:
        raise UnknownNameError("object", str(name), [*OBJECTS, *(f"FILE{suffix}" for suffix in meshes.FORMATS)])
    return meshes.to_mitsuba(meshes.turned(mesh, turn), material)


def camera(size: tuple[int, int], spp: int, seed: int) -> Description:
    """A long lens, a little above the object: the ground fills the picture behind it."""
    width, height = size
    return {
        "type": "perspective",
        "fov": 18.5,
        "fov_axis": "smaller",
        "to_world": mi.ScalarTransform4f().look_at(origin=[0, -8.6, 3.2], target=[0, 0, 1.02], up=[0, 0, 1]),
        "film": {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}},
        "sampler": {"type": "multijitter", "sample_count": spp, "seed": seed},
    }


def ground(floor: str) -> Description:
    """Matte paper or tiles, bright in the middle and darker towards an edge that is beyond the picture."""
    if floor not in FLOORS:
        raise UnknownNameError("floor", str(floor), FLOORS)
    if floor == "tiles":
        reflectance, middle = tiles(), mi.ScalarTransform3f().translate([0.5, 0.5])
        to_uv = middle.scale(GROUND_RADIUS / TILED).translate([-0.5, -0.5])
    else:
        # The disk's own coordinates are (radius, azimuth): one row of pixels makes a radial gradient.
        distance = np.linspace(0, GROUND_RADIUS, 128)
        reflectance, to_uv = (0.18 + 0.4 / (1 + (distance / 9) ** 2))[None, :, None], mi.ScalarTransform3f()
    bitmap = mi.Bitmap(reflectance.astype(np.float32))
    # Colours become spectra in spectral variants, where raw ones would be an error.
    raw = reflectance.shape[-1] == 1
    texture = {"type": "bitmap", "bitmap": bitmap, "raw": raw, "wrap_mode": "clamp", "to_uv": to_uv}
    return {
        "type": "rectangle" if floor == "tiles" else "disk",
        "to_world": mi.ScalarTransform4f().scale(GROUND_RADIUS),
        "bsdf": {"type": "diffuse", "reflectance": texture},
    }


def tiles(resolution: int = 1536) -> Map:
    """Reflectance (resolution, resolution, 3) of dark and light tiles, which blur into grey before they alias."""
    x = (np.arange(resolution) + 0.5) / resolution * 2 * TILED - TILED
    distance = np.hypot(x, x[:, None])
    place = x / TILE + 0.25  # the object stands off the joints
    light = (np.floor(place) + np.floor(place)[:, None]) % 2
    joint = np.abs(place - np.round(place)) * TILE
    joint = np.clip(np.minimum(joint, joint[:, None]) / 0.02, 0, 1)
    pattern = (0.32 + 0.36 * light) * (0.55 + 0.45 * joint) - 0.5
    seen = np.clip((9 - distance) / 5, 0, 1)
    grey = (0.5 + pattern * seen**2 * (3 - 2 * seen)) * (0.2 + 0.8 / (1 + (distance / 5) ** 2))
    # Far away it is the room's walls that one sees on it: blue to the left, amber to the right.
    side = np.clip(x / 4, -1, 1)[None, :, None] * (1 - seen)[..., None]
    return 0.82 * grey[..., None] * (1 + side * np.array([0.35, 0, -0.35]))


def lamps(light: str | None) -> dict[str, Description]:
    """Round lamps; each gives white paper that faces it about the radiance WHITE."""
    if light is None:
        return {}
    if light not in LIGHTS:
        raise UnknownNameError("light", str(light), [*LIGHTS])
    radiance = WHITE * (1 + (LAMP_DISTANCE / LAMP_RADIUS) ** 2)
    places = [np.array(place) * (LAMP_DISTANCE / np.linalg.norm(place)) for place in LIGHTS[light]]
    return {
        f"lamp_{n}": {
            "type": "disk",
            "to_world": mi.ScalarTransform4f()
            .look_at(origin=list(place), target=[0, 0, 1], up=[0, 0, 1])
            .scale(LAMP_RADIUS),
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": radiance}},
        }
        for n, place in enumerate(places)
    }


def environment(name: str | Path, exposure: float = 1.0) -> Description:
    """The light around the object; white paper on the ground has ``exposure`` times the radiance WHITE."""
    if name == "constant":
        return {"type": "constant", "radiance": {"type": "rgb", "value": WHITE * exposure}}
    if name == "sky":
        return sky(exposure)
    if name == "atelier":
        return lit_by(atelier(), exposure=exposure)
    if isinstance(name, str) and name in MAPS:
        azimuth, contrast = MAPS[name]
        radiance = read_map(Path(__file__).with_name("environments") / f"{name}.exr") ** contrast
        return lit_by(radiance / irradiance(radiance), azimuth, exposure)  # per channel: a white balance
    if isinstance(name, (str, Path)) and Path(name).suffix:
        return lit_by(read_map(Path(name)), exposure=exposure)
    raise UnknownNameError("environment", str(name), [*ENVIRONMENTS, *(f"FILE{suffix}" for suffix in MAP_FORMATS)])


def sky(exposure: float) -> Description:
    """A clear afternoon, the sun at the front left."""
    scale = 3.2 * WHITE * exposure  # measured on white paper
    return {
        "type": "sunsky",
        "sun_direction": [-0.6, -0.5, 0.62],
        "sun_scale": scale,
        "sky_scale": scale,
        # Twice the real sun, for a softer shadow; from 2 degrees on, Mitsuba's sampling of it becomes noisy.
        "sun_aperture": 1.0,
    }


def atelier(height: int = 256) -> Map:
    """Radiance (height, 2 height, 3) of a dim room, blue to the left and amber to the right, a window, and lamps."""
    azimuth = (np.arange(2 * height) + 0.5) / height * 180  # from the back, clockwise seen from above
    elevation = 90 - (np.arange(height)[:, None] + 0.5) / height * 180
    right = (0.5 + 0.5 * np.sin(np.radians(azimuth)))[None, :, None]
    walls = np.array([0.01, 0.06, 0.15]) * (1 - right) + np.array([0.2, 0.07, 0.015]) * right
    radiance = walls * (0.3 + 0.7 * np.cos(np.radians(elevation)))[..., None]
    boxes = [
        # azimuth and elevation of the middle, half width and half height, in degrees; radiance
        ((225, 40, 24, 22), (9.0, 8.5, 7.8)),
        ((62, 34, 7, 30), (4.5, 6.0, 8.0)),
        ((318, 22, 10, 14), (6.0, 2.4, 0.8)),
        ((140, 72, 40, 5), (2.2, 2.3, 2.4)),
    ]
    for n, ((x, y, width, height), colour) in enumerate(boxes):
        across, up = np.abs((azimuth - x + 180) % 360 - 180)[None, :], np.abs(elevation - y)
        inside = np.clip((width - across) / 2, 0, 1) * np.clip((height - up) / 2, 0, 1)
        if n == 0:  # the bars of the window
            inside = inside * np.clip(across / 1.5 - 0.5, 0, 1) * np.clip(up / 1.5 - 0.5, 0, 1)
        radiance = radiance + inside[..., None] * np.array(colour)
    return radiance


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


def lit_by(radiance: Map, azimuth: float = 0.0, exposure: float = 1.0) -> Description:
    """A map, z up, turned counterclockwise by ``azimuth`` degrees, and exposed."""
    exposed = radiance * (np.pi * WHITE * exposure / irradiance(radiance).mean())
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
