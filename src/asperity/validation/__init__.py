"""One file a paper: its claims, figures and tables, measured against the ground truth."""

from collections.abc import Callable
from typing import Any

from . import lambertsphere, micrograin, vgroove

PAPERS: dict[str, Callable[..., Any]] = {
    "micrograin": micrograin.sections,
    "vgroove": vgroove.sections,
    "lambertsphere": lambertsphere.sections,
}
"""What makes the sections of a model's report, by the model's name."""
