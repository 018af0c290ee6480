"""What `rank` compares: every model, and what Mitsuba has, each with all that it may be fitted by."""

from __future__ import annotations

from typing import Any

from ..errors import ParameterError
from ..materials import resolve

Description = dict[str, Any]

GREY = 0.5
"""Where reflectances start; the search has other starts as well."""
METAL: Description = {"reflectivity": GREY, "edge_tint": GREY}
DIFFUSE: Description = {"type": "diffuse", "reflectance": GREY}


def plus_diffuse(description: Description) -> Description:
    """A material and a Lambertian in shares, which both keep their energy."""
    return {"type": "blendbsdf", "weight": GREY, "bsdf_0": description, "bsdf_1": dict(DIFFUSE)}


MICROGRAIN: Description = {"type": "micrograin", "base": dict(DIFFUSE)}
VGROOVE: Description = {"type": "vgroove", "symmetric": False, **METAL}
TWOSCALE: Description = {"type": "twoscale", **METAL}
ROUGHCONDUCTOR: Description = {"type": "roughconductor", "distribution": "ggx", "eta": 1.0, "k": 1.0}

CANDIDATES: dict[str, Description] = {
    "micrograin": MICROGRAIN | METAL,
    "micrograin, coated": MICROGRAIN | {"int_ior": 1.5},
    "lambertsphere": {"type": "lambertsphere"},
    "orennayar": {"type": "orennayar"},
    "interfacedlambertian": {"type": "interfacedlambertian", "distribution": "ggx"},
    "vgroove": VGROOVE,
    "vgroove + diffuse": plus_diffuse(VGROOVE),
    "twoscale": TWOSCALE,
    "twoscale + diffuse": plus_diffuse(TWOSCALE),
    "roughconductor": ROUGHCONDUCTOR,
    "roughconductor + diffuse": plus_diffuse(ROUGHCONDUCTOR),
    "roughplastic": {"type": "roughplastic", "distribution": "ggx", "ext_ior": 1.0, "int_ior": 1.5, "nonlinear": True},
    "principled": {"type": "principled", "base_color": GREY, "metallic": GREY, "specular": GREY},
    "diffuse": DIFFUSE,
}
"""By the names that users give. A sum with ``diffuse`` is of those that have no diffuse part of their own."""


def description(model: Any, plus: str | None = None) -> tuple[str, Description]:
    """Name and description of what to fit: a candidate, or anything that `materials.resolve` takes.

    ``plus`` may be ``diffuse``, which adds a Lambertian.
    """
    if isinstance(model, str) and model in CANDIDATES:
        name, found = model, CANDIDATES[model]
    else:
        material = resolve(model)
        if material.description is None:
            raise ParameterError(f"model: {material.name} has no parameters to fit, only a description has.")
        name, found = material.name, material.description
    if plus not in (None, "diffuse"):
        raise ParameterError(f"plus = {plus!r}: expected 'diffuse'.")
    return (f"{name} + diffuse", plus_diffuse(found)) if plus else (name, found)
