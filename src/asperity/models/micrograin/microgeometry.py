"""Grains one can hit: half-ellipsoids at Poisson positions on a plane, as the ground truth of the model."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

import mitsuba as mi
import numpy as np

from ...goniophotometer.microgeometry import Tile

BLACK = {"type": "diffuse", "reflectance": 0.0}
COHERENT = 4096
"""Grains in the window through which a batch of rays enters a larger tile: few enough for the processor's cache."""


@dataclass(frozen=True)
class Grains:
    """Half-ellipsoids of semi-axes 1/beta_x, 1/beta_y, 1 that cover the share ``tau_0`` of a plane; they may overlap.

    ``grain`` and ``base`` are descriptions of BSDFs; ``grains`` is the mean number of grains in a tile.
    """

    tau_0: float = 0.3
    beta_x: float = 1.0
    beta_y: float = 1.0
    grain: dict[str, Any] = field(default_factory=lambda: {"type": "conductor", "material": "none"})
    base: dict[str, Any] = field(default_factory=lambda: BLACK)
    grains: int = 4096

    @property
    def description(self) -> dict[str, Any]:
        """All of it."""
        return {"type": "grains"} | asdict(self)

    def tile(self, rng: np.random.Generator) -> Tile:
        """A tile as large as it must be for its number of grains."""
        stretch = np.array([1 / self.beta_x, 1 / self.beta_y])
        side = np.sqrt(self.grains * np.pi / -np.log1p(-self.tau_0))  # in sphere space
        centres = rng.uniform(-side / 2, side / 2, (rng.poisson(self.grains), 2))
        centres = np.concatenate([centres + shift for shift in _neighbours(side)])
        centres = centres[np.all(np.abs(centres) < side / 2 + 1, axis=1)]
        n = len(centres)
        width, depth = side * stretch
        shapes: dict[str, Any] = {
            "type": "scene",
            "base": {
                "type": "rectangle",
                "to_world": mi.ScalarTransform4f().scale([width, depth, 1]),
                "bsdf": self.base,
            },
        }
        if n:
            shapes["grains"] = {
                "type": "ellipsoids",  # only their upper halves are above the base
                "centers": _tensor(np.c_[centres * stretch, np.zeros(n)]),
                "scales": _tensor(np.tile([*stretch, 1], (n, 1))),
                "quaternions": _tensor(np.tile([0, 0, 0, 1], (n, 1))),
                "extent": 1.0,
                "extent_adaptive_clamping": False,
                "bsdf": self.grain,
            }
        window = np.sqrt(width * depth * min(1, COHERENT / self.grains))
        return Tile(mi.load_dict(shapes, parallel=False), width, depth, -1e-3, 1 + 1e-3, window)


def _neighbours(side: float) -> np.ndarray:
    """The shifts to a periodic tile's own place and to its eight neighbours'."""
    steps = np.array([-side, 0, side])
    return np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 1, 2)


def _tensor(values: np.ndarray) -> mi.TensorXf:
    return mi.TensorXf(np.ascontiguousarray(values, dtype=np.float32))
