"""The registry: one line a model."""

from typing import Any

from .baselines.deon import DEon
from .baselines.merillou import Merillou
from .baselines.orennayar import OrenNayar
from .interfacedlambertian import InterfacedLambertian
from .lambertsphere import Chandrasekhar, LambertSphere, LambertSpherePhase
from .micrograin import Micrograin
from .textures import Settled
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
}
"""BSDF plugins by the name that a scene uses."""

TEXTURES: dict[str, Any] = {"settled": Settled}
"""Texture plugins by the name that a scene uses."""

PHASES: dict[str, Any] = {"lambertsphere_phase": LambertSpherePhase}
"""Phase functions by the name that a scene uses. It cannot be that of a BSDF: to Mitsuba all plugins are one list."""
