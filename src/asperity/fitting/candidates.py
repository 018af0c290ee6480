"""What `rank` compares: every model, and what Mitsuba has, each with all that it may be fitted by."""

from __future__ import annotations

from typing import Any

import mitsuba as mi

from ..errors import ParameterError
from ..materials import resolve
from ..models import MODELS

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


NESTED = {"blendbsdf": "bsdf_{}", "twosided": "brdf_{}", "mask": "nested_bsdf", "bumpmap": "nested_bsdf"}
"""What ``mi.traverse`` calls the BSDFs that Mitsuba's plugins nest, whatever a description calls them."""


def as_traversed(node: Description) -> Description:
    """A description whose nested BSDFs have the names by which ``mi.traverse`` knows their parameters."""
    found, count = dict(node), 0
    for name, part in node.items():
        if not isinstance(part, dict):
            continue
        found[name] = as_traversed(part)
        if node.get("type") in NESTED and is_bsdf(part.get("type")):
            del found[name]
            found[NESTED[node["type"]].format(count)] = as_traversed(part)
            count += 1
    return found


def is_bsdf(plugin: Any) -> bool:
    """Whether this is the name of one."""
    kind = mi.PluginManager.instance().plugin_type
    return isinstance(plugin, str) and (plugin in MODELS or kind(plugin) == mi.ObjectType.BSDF)


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
    found = as_traversed(found)
    return (f"{name} + diffuse", plus_diffuse(found)) if plus else (name, found)
