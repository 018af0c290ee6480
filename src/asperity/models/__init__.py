"""The registry: one line a model."""

from typing import Any

from .micrograin import Micrograin
from .textures import Settled

MODELS: dict[str, Any] = {"micrograin": Micrograin}
"""BSDF plugins by the name that a scene uses."""

TEXTURES: dict[str, Any] = {"settled": Settled}
"""Texture plugins by the name that a scene uses."""
