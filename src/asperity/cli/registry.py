"""The models, by name."""

from __future__ import annotations

import inspect
from typing import Any

from asperity.errors import UnknownNameError


def models() -> dict[str, Any]:
    """All models."""
    from asperity.models import MODELS

    return MODELS


def model(name: str) -> Any:
    """The model of that name."""
    if name not in models():
        raise UnknownNameError("model", name, models())
    return models()[name]


def described(name: str) -> Any:
    """The model, texture or phase function of that name."""
    from asperity.models import PHASES, TEXTURES
    from asperity.scenes import presets

    known = models() | TEXTURES | PHASES
    if name not in known:
        raise UnknownNameError("model, texture, phase function or preset", name, [*known, *presets.names()])
    return known[name]


def about(model: Any) -> str:
    """The docstring of a model, without its quotation marks for code."""
    return inspect.getdoc(model).replace("``", "")  # type: ignore[union-attr]  # D1: all models have one
