"""Random descriptions of materials: all models, parameters of all kinds, and now and then a flaw."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np

from asperity import conductors, parameters
from asperity.models import MODELS

Rng = np.random.Generator
Description = dict[str, Any]

PLAIN = [{"type": "diffuse"}, {"type": "roughconductor", "alpha": 0.2}, {"type": "plastic"}, {"type": "dielectric"}]


def one_of(rng: Rng, *choices: Any) -> Any:
    return choices[rng.integers(len(choices))]


def number(rng: Rng, low: float, high: float) -> float:
    """In the range, often at its ends."""
    usual = rng.uniform(low, min(high, 4.0), size=5)
    return float(one_of(rng, low, min(high, 10.0 ** rng.integers(1, 30)), *usual))


def texels(rng: Rng, values: Any, **given: Any) -> Description:
    array = np.resize(np.float32(values), (2, 2, np.size(values)))
    return {"type": "bitmap", "bitmap": mi.Bitmap(array), "wrap_mode": one_of(rng, "repeat", "clamp"), **given}


def texture(rng: Rng, parameter: parameters.Texture) -> Any:
    """A number or a texture that the parameter allows."""

    def draw() -> float:
        return number(rng, parameter.low, parameter.high)

    return one_of(
        rng,
        draw(),
        draw(),
        {"type": "uniform", "value": draw()},
        {"type": "checkerboard", "color0": draw(), "color1": draw()},
        texels(rng, draw(), raw=True),
    )


def colour(rng: Rng) -> Any:
    """A reflectance in one of the many ways to give one."""
    values = [float(x) for x in np.clip(rng.uniform(-0.2, 1.2, 3), 0, 1)]
    return one_of(
        rng,
        values[0],
        {"type": "rgb", "value": values},
        {"type": "spectrum", "value": list(zip((400, 550, 700), values))},
        {"type": "irregular", "wavelengths": "400, 550, 700", "values": ", ".join(map(str, values))},
        {"type": "checkerboard", "color0": {"type": "rgb", "value": values}, "color1": values[0]},
        texels(rng, values),
    )


def metal(rng: Rng, parameter: conductors.Conductor) -> Description:
    """Some of the parameters of a conductor."""
    material, eta, k, reflectivity, edge_tint = parameter.names()
    named = str(one_of(rng, *conductors.materials()))
    indices = {eta: float(rng.uniform(0.1, 3)), k: float(rng.uniform(0, 5))}
    return one_of(rng, {material: named}, indices, {reflectivity: colour(rng)}, {reflectivity: 0.9, edge_tint: 0.5})


def material(rng: Rng, depth: int = 0) -> Description:
    """A BSDF of ours, its parameters in range, though some may exclude each other."""
    name = str(one_of(rng, *MODELS))
    found: Description = {"type": name}
    for parameter in MODELS[name].declarations():
        if rng.random() < 0.6:
            continue
        if isinstance(parameter, conductors.Conductor):
            found |= metal(rng, parameter)
        elif isinstance(parameter, parameters.Colour):
            found[parameter.name] = colour(rng)
        elif isinstance(parameter, parameters.Ior):
            found[parameter.name] = one_of(rng, "bk7", "water", 1.0, 1.5, float(rng.uniform(0.5, 5)))
        elif isinstance(parameter, parameters.Axes):
            both = parameter.names()[1:]
            for axis in one_of(rng, [parameter.name], both[:1], both):
                found[axis] = texture(rng, parameter)
        elif isinstance(parameter, parameters.Texture):
            found[parameter.name] = texture(rng, parameter)
        elif isinstance(parameter, parameters.Choice):
            found[parameter.name] = one_of(rng, *parameter.options)
        elif isinstance(parameter, parameters.Integer):
            found[parameter.name] = int(rng.integers(parameter.low, 12))
        elif isinstance(parameter, parameters.Flag):
            found[parameter.name] = bool(rng.integers(2))
        elif isinstance(parameter, parameters.BSDF):
            found[parameter.name] = (
                material(rng, depth + 1) if rng.random() < 0.3 and depth < 2 else dict(one_of(rng, *PLAIN))
            )
    return wrapped(rng, found) if depth == 0 else found


def wrapped(rng: Rng, bsdf: Description) -> Description:
    """The BSDF, perhaps within another one of Mitsuba's."""
    return one_of(
        rng,
        bsdf,
        bsdf,
        {"type": "twosided", "bsdf": bsdf},
        {"type": "mask", "bsdf": bsdf, "opacity": 0.5},
        {"type": "blendbsdf", "weight": 0.3, "one": bsdf, "two": {"type": "diffuse"}},
    )


def nodes(description: Description) -> list[Description]:
    """A description and all that are nested in it."""
    inner = [node for value in description.values() if isinstance(value, dict) for node in nodes(value)]
    return [description, *inner]


def flaw(rng: Rng, description: Description) -> str:
    """Put something into the description that nobody may accept; and say what."""
    node = one_of(rng, *nodes(description))
    key = str(one_of(rng, *node))
    bad = {
        "null": None,
        "nan": float("nan"),
        "infinite": float("-inf"),
        "empty": {},
        "untyped": {"value": 0.5},
        "misspelt": {"type": "bitmapp", "filename": "x.png"},
        "no file": {"type": "bitmap", "file": "x.png"},
        "lost file": {"type": "bitmap", "filename": "no/such.exr"},
        "list": [0.1, None],
        "spectrum": {"type": "spectrum", "value": [(400, 0.1), (700, float("nan"))]},
        "colour": {"type": "rgb", "value": [0.1, 0.2, "a"]},
        "texels": texels(rng, [np.nan]),
        "huge": 10**400,
    }
    what = str(one_of(rng, *bad, "unknown", "circular"))
    if what == "unknown":
        node[f"{key}_0x"] = 0.5
    elif what == "circular":
        node["nested"] = description
    else:
        node[key] = bad[what]
    return f"{what} at {key}"
