"""Scenes to time: what a user feels, and what is little but the BSDF."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mitsuba as mi

from ...scenes.preview import preview

Description = dict[str, Any]
LIGHTS: Description = {
    "constant": {"type": "constant", "radiance": 0.5},
    "point": {"type": "point", "position": [3, -3, 5], "intensity": 30.0},
}


def scenes(size: int, spp: int) -> dict[str, Callable[[Description], Description]]:
    """By their names, what makes a scene of a material.

    *bare*: a sphere on a plane, constant light and a point light: little tracing, so the BSDF is much of the frame.
    *preview*: the default object of `asperity render` under an environment map. *filled*: the same, the floor of the
    same material, so that the BSDF is most of the frame. *point*: *bare* by the point light alone.
    """
    return {
        "bare": lambda material: bare(material, LIGHTS, size, 4 * spp),
        "preview": lambda material: preview(material, size=(size, size), spp=spp),
        "filled": lambda material: filled(material, size, spp),
        "point": lambda material: bare(material, {"point": LIGHTS["point"]}, size, spp),
    }


def bare(material: Description, lights: Description, size: int, spp: int) -> Description:
    """A sphere on a plane."""
    look_at = mi.ScalarTransform4f().look_at
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 6},
        "sensor": {
            "type": "perspective",
            "fov": 35,
            "to_world": look_at([0, -6, 3], [0, 0, 0.6], [0, 0, 1]),
            "film": {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}},
            "sampler": {"type": "independent", "sample_count": spp},
        },
        **lights,
        "plane": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(8), "bsdf": {"type": "ref", "id": "m"}},
        "sphere": {"type": "sphere", "center": [0, 0, 1], "bsdf": {"type": "ref", "id": "m"}},
        "m": {**material, "id": "m"},
    }


def filled(material: Description, size: int, spp: int) -> Description:
    """The preview, on a floor of the same."""
    scene = preview(material, size=(size, size), spp=spp, integrator={"type": "path", "max_depth": 6})
    return scene | {"ground": scene["ground"] | {"bsdf": material}}
