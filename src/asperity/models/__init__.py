"""The registry: one line a model."""

from .micrograin import Micrograin
from .textures import Settled

MODELS = {"micrograin": Micrograin}
"""BSDF plugins by the name that a scene uses."""

TEXTURES = {"settled": Settled}
"""Texture plugins by the name that a scene uses."""
