"""Grains one can hit: half-ellipsoids at Poisson positions on a plane, as the ground truth of the model."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

import mitsuba as mi
import numpy as np

from ...errors import ParameterError
from ...goniophotometer.tile import Tile

BLACK = {"type": "diffuse", "reflectance": 0.0}
MARGIN = 1e-5
"""From the base to the tile's bottom: of light that a base of glass lets through, hardly any meets a grain below it."""
COHERENT = 4096
"""Grains in the window through which a batch of rays enters a larger tile: few enough for the processor's cache."""


@dataclass(frozen=True)
class ExplicitGrains:
    """Half-ellipsoids of semi-axes 1/beta_x, 1/beta_y, 1 that cover the share ``tau_0`` of a plane; they may overlap.

    ``grain`` and ``base`` are descriptions of BSDFs; ``grains`` is the mean number of grains in a tile.
    """

    tau_0: float = 0.3
    beta_x: float = 1.0
    beta_y: float = 1.0
    grain: dict[str, Any] = field(default_factory=lambda: {"type": "conductor", "material": "none"})
    base: dict[str, Any] = field(default_factory=lambda: BLACK)
    grains: int = 4096

    def __post_init__(self) -> None:
        for name in ("tau_0", "beta_x", "beta_y"):
            _number(name, getattr(self, name))
        if not 0 <= self.tau_0 < 1:
            raise ParameterError(
                f"tau_0 = {self.tau_0:g}: simulated grains cover [0, 1) of the base; 1 needs endless many."
            )
        if not (self.beta_x > 0 and self.beta_y > 0):
            raise ParameterError(f"beta_x = {self.beta_x:g}, beta_y = {self.beta_y:g}: expected numbers above 0.")
        if not 1 <= self.grains <= 1e8:
            raise ParameterError(f"grains = {self.grains}: expected a number in [1, 1e8].")

    @classmethod
    def of(cls, model: dict[str, Any], given: set[str]) -> ExplicitGrains:
        """The grains that a ``micrograin`` BSDF models; of its parameters the scene has ``given`` some itself.

        Coated grains are Mitsuba's ``plastic``, with inner reflections, which the model neglects: for an index of 1.5
        its diffuse part is 1.10 times the model's, in all directions.
        """
        for name in ("variation", "reflectivity", "edge_tint"):
            if name in given and model[name] != "none":
                raise ParameterError(
                    f"{name}: not simulated; facets have one colour, by material, eta and k, or albedo."
                )
        coat, metal = {"int_ior", "ext_ior"} & given, {"material", "eta", "k"} & given
        if not model["specular"]:
            grain = {"type": "diffuse", "reflectance": model["diffuse_reflectance"]}
        elif coat or "diffuse_reflectance" in given:
            grain = {"type": "plastic"} | {name: model[name] for name in ("int_ior", "ext_ior", "diffuse_reflectance")}
        else:
            grain = {"type": "conductor"} | ({name: model[name] for name in metal} or {"material": "none"})
        if "beta" in given:  # by the name that was given
            _number("beta", model["beta"])
        beta_x, beta_y = (model[name] if name in given else model["beta"] for name in ("beta_x", "beta_y"))
        return cls(model["tau_0"], beta_x, beta_y, grain, model["base"] or BLACK)

    @property
    def description(self) -> dict[str, Any]:
        """All of it."""
        return {"type": "grains"} | asdict(self)

    @property
    def size(self) -> np.ndarray:
        """Width and depth of a tile, as large as it must be for its number of grains."""
        side = np.sqrt(self.grains * np.pi / max(-np.log1p(-self.tau_0), 1e-9))  # in sphere space
        return side / np.array([self.beta_x, self.beta_y])

    def centres(self, rng: np.random.Generator) -> np.ndarray:
        """Where grains are (n, 2), with those of neighbouring tiles that reach into this one."""
        centres = rng.uniform(-0.5, 0.5, (rng.poisson(self.grains), 2))
        centres = np.concatenate([centres + shift for shift in np.ndindex(3, 3)]) - 1
        radii = 1 / np.array([self.beta_x, self.beta_y])
        return (centres * self.size)[np.all(np.abs(centres) * self.size < self.size / 2 + radii, axis=1)]

    def piece(self, rng: np.random.Generator) -> Tile:
        """A tile with grains of its own."""
        (width, depth), centres = self.size, self.centres(rng)
        n = len(centres)
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
                "centers": _tensor(np.c_[centres, np.zeros(n)]),
                "scales": _tensor(np.tile([1 / self.beta_x, 1 / self.beta_y, 1], (n, 1))),
                "quaternions": _tensor(np.tile([0, 0, 0, 1], (n, 1))),
                "extent": 1.0,
                "extent_adaptive_clamping": False,
                "bsdf": self.grain,
            }
        window = np.sqrt(width * depth * min(1, COHERENT / self.grains))
        return Tile(mi.load_dict(shapes, parallel=False), width, depth, -MARGIN, 1 + MARGIN, True, window)


def _number(name: str, value: Any) -> None:
    if not isinstance(value, int | float):
        raise ParameterError(f"{name} = {value!r}: simulated grains are alike everywhere; expected one number.")


def _tensor(values: np.ndarray) -> mi.TensorXf:
    return mi.TensorXf(np.ascontiguousarray(values, dtype=np.float32))
