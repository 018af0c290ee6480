"""Grooves one can hit, as the ground truth of the model: every ray meets one of its own."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ...errors import ParameterError
from ...goniophotometer.grooves import Grooves, Shape
from ...goniophotometer.tile import opaque
from ...microfacet.distributions import DISTRIBUTIONS
from .tilts import Tilts


@dataclass(frozen=True)
class ExplicitGrooves:
    """V-grooves whose facets follow a distribution of normals, their openings side by side in one plane.

    ``symmetric`` grooves have facets of equal tilt; else the tilts are independent (Lee et al. 2018, Eq. 20).
    ``facet`` is the description of a BSDF.
    """

    distribution: str = "ggx"
    alpha_u: float = 0.3
    alpha_v: float = 0.3
    symmetric: bool = True
    facet: dict[str, Any] = field(default_factory=lambda: {"type": "conductor", "material": "none"})

    def __post_init__(self) -> None:
        for name in ("alpha_u", "alpha_v"):
            _number(name, alpha := getattr(self, name))
            if not alpha > 0:
                raise ParameterError(f"{name} = {alpha!r}: expected a number above 0.")

    @classmethod
    def of(cls, model: dict[str, Any], given: set[str]) -> ExplicitGrooves:
        """The grooves that a ``vgroove`` BSDF models; of its parameters the scene has ``given`` some itself."""
        for name in {"reflectivity", "edge_tint"} & given:
            raise ParameterError(f"{name}: not simulated; give the metal by material, or by eta and k.")
        for name in sorted({"alpha", "exponent"} & given):  # by the name that was given
            _number(name, model[name])
        alpha = float(np.sqrt(2 / (model["exponent"] + 2))) if "exponent" in given else model["alpha"]
        alpha_u, alpha_v = (model[name] if name in given else alpha for name in ("alpha_u", "alpha_v"))
        metal = {name: model[name] for name in {"material", "eta", "k"} & given} or {"material": "none"}
        return cls(model["distribution"], alpha_u, alpha_v, model["symmetric"], {"type": "conductor"} | metal)

    @property
    def description(self) -> dict[str, Any]:
        """All of it."""
        return {"type": "grooves"} | asdict(self)

    def piece(self, rng: np.random.Generator) -> Grooves:
        """Always the same; the grooves are drawn with the rays."""
        return Grooves(self.draw, mi.load_dict(self.facet))

    def draw(self, rng: mi.PCG32) -> Shape:
        """Grooves by ground area: a facet with density D cos θ, and its partner."""
        distribution = DISTRIBUTIONS[self.distribution](*opaque(mi.Point2f, self.alpha_u, self.alpha_v))
        cos, sin = distribution.sample_azimuth(rng.next_float32())
        tilts = Tilts.along(distribution, cos, sin)
        first = dr.atan2(*tilts.sample(rng.next_float32()))
        if self.symmetric:
            return Shape(mi.Vector2f(cos, sin), first, first)
        partner = tilts.sample_partner(*(rng.next_float32() for _ in range(3)))
        return Shape(mi.Vector2f(cos, sin), first, dr.atan2(*partner))


def _number(name: str, value: Any) -> None:
    if not isinstance(value, int | float):
        raise ParameterError(f"{name} = {value!r}: simulated grooves are alike everywhere; expected one number.")
