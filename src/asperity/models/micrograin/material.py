"""What grains are made of: metal, diffuse matter, or that under a dielectric coat, in one colour or two."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr

from ...microfacet.numerics import TINY
from ...microfacet.quadrature import gauss_legendre
from .coat import Coat
from .grains import SecondColour


@dataclass
class Facet:
    """What a grain's facets are, beside Lambertian of albedo 1: dataclasses, since they pass through recorded loops."""

    second: SecondColour | None = None  # where there is a second albedo
    coat: Coat | None = None

    @property
    def alike_around(self) -> bool:
        """Whether facets at one height are the same."""
        return self.coat is None and (self.second is None or self.second.by_height)

    @property
    def smooth(self) -> bool:
        """Whether few nodes do: a coat of index below 1 has a critical angle."""
        return self.coat is None or self.coat.fitted is not None


@dataclass
class Material:
    """The grains' material at a surface point; what it has not is None."""

    metal: Any = None  # `Metal`, `mirror`, `Dielectric`: reflectance, a function of the cosine
    metal_2: Any = None
    coat: Any = None
    albedo: Any = None  # of diffuse grains, or those under a coat
    albedo_2: Any = None
    second: Any = None  # `SecondColour`: where metal_2 or albedo_2 is

    @property
    def facet(self) -> Facet:
        """What the integral of diffuse grains needs of it."""
        return Facet(self.second, self.coat)

    @property
    def mean_colour(self) -> Any:
        """Mean of the two albedos, or the only one."""
        return self.albedo if self.albedo_2 is None else (self.albedo + self.albedo_2) / 2

    def reflectance(self, cos: Any, h: Any, m: Any) -> Any:
        """F of the surface, for the cosine of incidence, at height ``h`` with normal ``m``."""
        surface = self.metal if self.coat is None else self.coat
        if self.metal_2 is not None:
            surface = self.metal.mixed(self.metal_2, self.second(h, m))
        return surface(cos)

    def diffuse_part(self, cos: Any) -> Any:
        """Probability p_Sd of the diffuse lobe among the grains', for the cosine of wi (Lucas 2024, Eq. 27)."""
        if self.albedo is None:
            return 0
        if self.coat is None:
            return 1
        albedo = dr.mean(self.mean_colour)
        return albedo / dr.maximum(albedo + self.coat(cos), TINY)

    def mean_albedo(self) -> Any:
        """Hemispherical mean of what a facet reflects, at half height and upright."""
        mean = 0
        if self.metal is not None or self.coat is not None:
            upright = dr.scalar.Array3f(0, 0, 1)
            for cos, weight in zip(*gauss_legendre(4)):
                mean = mean + 2 * cos * weight * self.reflectance(cos, 0.5, upright)
        return mean if self.albedo is None else mean + dr.square(1 - mean) * self.mean_colour
