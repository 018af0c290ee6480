"""The registry: one line a model."""

from typing import Any

from ..errors import ParameterError
from .baselines.deon import DEon
from .baselines.merillou import Merillou
from .baselines.orennayar import OrenNayar
from .interfacedlambertian import InterfacedLambertian
from .lambertsphere import Chandrasekhar, LambertSphere, LambertSpherePhase
from .micrograin import Micrograin
from .textures import Settled
from .twoscale import TwoScale
from .vgroove import VGroove

MODELS: dict[str, Any] = {
    "micrograin": Micrograin,
    "merillou": Merillou,
    "deon": DEon,
    "vgroove": VGroove,
    "lambertsphere": LambertSphere,
    "chandrasekhar": Chandrasekhar,
    "orennayar": OrenNayar,
    "interfacedlambertian": InterfacedLambertian,
    "twoscale": TwoScale,
}
"""BSDF plugins by the name that a scene uses."""

TEXTURES: dict[str, Any] = {"settled": Settled}
"""Texture plugins by the name that a scene uses."""

PHASES: dict[str, Any] = {"lambertsphere_phase": LambertSpherePhase}
"""Phase functions by the name that a scene uses. It cannot be that of a BSDF: to Mitsuba all plugins are one list."""


def with_microgeometry() -> list[str]:
    """Names of the models that have a microgeometry to measure."""
    return [name for name, model in MODELS.items() if model.geometry is not None]


def microgeometry(description: dict[str, Any]) -> Any:
    """The explicit microgeometry that a scene's description of a model stands for; raises ParameterError."""
    if (name := description.get("type")) not in with_microgeometry():
        known = ", ".join(with_microgeometry())
        raise ParameterError(f"{name!r} has no microgeometry to measure. Those that have: {known}.")
    return MODELS[name].microgeometry(description)
