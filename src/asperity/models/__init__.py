"""The registry: one line a model."""

from typing import Any

from .baselines.deon import DEon
from .baselines.merillou import Merillou
from .micrograin import Micrograin
from .textures import Settled

MODELS: dict[str, Any] = {"micrograin": Micrograin, "merillou": Merillou, "deon": DEon}
"""BSDF plugins by the name that a scene uses."""

TEXTURES: dict[str, Any] = {"settled": Settled}
"""Texture plugins by the name that a scene uses."""
