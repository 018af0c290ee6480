"""The two lobes: what facets mirror once, and what comes from the bodies below them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from ...lobes import Lobe
from ...microfacet.distributions import Distribution
from ...microfacet.sampling import about, cosine_hemisphere, reflect
from .body import GRAZING, fresnel, interface, outer_reflectance
from .facets import Facets

FACING = 0.6
"""Share of the body's samples that are about a typical facet, for grazing light on rough ones."""


def lift(w: Any) -> Any:
    """``w``, raised to a cosine of `GRAZING` at least."""
    return type(w)(w.x, w.y, dr.maximum(w.z, GRAZING))


def typical_slope(distribution: Distribution, w: Any) -> Any:
    """How much facets are tilted towards ``w``, times its sine: so much more than the surface they face it."""
    return dr.sqrt(dr.square(distribution.alpha_u * w.x) + dr.square(distribution.alpha_v * w.y) + 1e-14)


def grazing(distribution: Distribution, w: Any) -> Any:
    """From 0, where facets meet ``w`` as the surface does, to 1, where rough ones face it and the surface does not."""
    slope = typical_slope(distribution, w)
    return slope / (w.z + slope)


def typical_normal(distribution: Distribution, w: Any) -> Any:
    """Normal of the facets that send light back along ``w``, roughly; the factor is fitted, see `Body`."""
    x, y = dr.square(distribution.alpha_u) * w.x, dr.square(distribution.alpha_v) * w.y
    return dr.normalize(type(w)(x, y, w.z + 1.5 * typical_slope(distribution, w)))


def mirrored_share(distribution: Distribution, facets: Facets, n: Any, w: Any) -> Any:
    """Share of the light along ``w`` that facets mirror, roughly: F at a typical cosine.

    From low down, and on rough facets, a part is met at grazing incidence, where F is many times as large. What level
    facets mirror then is not shadowed in V-cavities, and weighs F over this share: which is part of F at least.
    """
    cos = dr.minimum(w.z + typical_slope(distribution, w), 1)
    share = dr.lerp(fresnel(cos, n), fresnel(cos / 4, n), (cos - w.z) / (2 * cos))
    return dr.maximum(share, facets.level * fresnel(w.z, n)) if facets.level else share


def evenly(w: Any) -> Any:
    """A direction that is even over the hemisphere, from one that is by cosine: z^2 is even where z is by cosine."""
    wide = dr.sqrt(1 + w.z * w.z)
    return type(w)(w.x * wide, w.y * wide, w.z * w.z)


@dataclass
class Interface(Lobe):
    """The lobe of the interfaces (Eq. 4), drawn by visible normals."""

    distribution: Distribution
    facets: Facets
    n: Any

    def share(self, wi: Any) -> Any:
        """F at typical facets; less if the lobe is no higher than the body's, whose samples do then.

        By mirroring, the density is about 1 / (4 pi alpha^2 cos_i) at its highest, by cosine cos_i / pi there.
        """
        lower = 4 * self.distribution.alpha_u * self.distribution.alpha_v * dr.square(wi.z)
        return mirrored_share(self.distribution, self.facets, self.n, wi) / (1 + dr.square(lower))

    def eval_pdf(self, wi: Any, wo: Any) -> tuple[Any, Any]:
        """F D G / (4 cos_i), and the density of visible normals over 4 i.m."""
        m = dr.normalize(wi + wo)
        density = self.facets.visible_density(self.distribution, wi, m) / (4 * dr.dot(wi, m))
        return interface(self.distribution, self.facets, self.n, wi, wo), density

    def draw(self, wi: Any, u: Any, v: Any) -> Any:
        """Mirrored in a visible normal."""
        return reflect(wi, self.facets.visible_normal(self.distribution, wi, u, v))


@dataclass
class Body(Lobe):
    """The lobe of the bodies below the interfaces (Eq. 13), drawn by cosine about the surface, mostly.

    Grazing light is sent back by the facets that face it: a part is drawn by cosine about one of them. And its value
    keeps up until the view is as low as the light, most of all in V-cavities, whose upper ends are lit and seen: a part
    is drawn evenly. These parts are fitted, to the least variance with weights below 2 at 87 degrees.
    """

    distribution: Distribution
    facets: Facets
    n: Any
    scale: Any  # Q, a spectrum
    light: Callable[[Any, Any, Any], Any]  # (wi, wo, Q) -> f per steradian

    def share(self, wi: Any) -> Any:
        """What typical facets let in, and out again."""
        inside = 1 - mirrored_share(self.distribution, self.facets, self.n, wi)
        return inside * (1 - outer_reflectance(self.n)) * dr.mean(mi.UnpolarizedSpectrum(self.scale))

    def eval_pdf(self, wi: Any, wo: Any) -> tuple[Any, Any]:
        """(f cos_o, the mean of both cosines over pi, and 1 / (2 pi))."""
        facing, even = self._parts(wi)
        about_facet = dr.maximum(dr.dot(typical_normal(self.distribution, wi), wo), 0)
        density = wo.z + facing * (about_facet - wo.z) + even * (0.5 - wo.z)
        return self.light(wi, wo, self.scale) * wo.z, density / dr.pi

    def draw(self, wi: Any, u: Any, v: Any) -> Any:
        """By cosine about either, or evenly."""
        facing, even = self._parts(wi)
        wo = cosine_hemisphere(v.x, v.y)
        up = dr.select(u < facing + even, evenly(wo), wo)
        return dr.select(u < facing, about(typical_normal(self.distribution, wi), wo), up)

    def _parts(self, wi: Any) -> tuple[Any, Any]:
        """Shares of the samples that are about a typical facet, and even; 1 together at most."""
        low = grazing(self.distribution, wi)
        return FACING * low, self.facets.horizon * low**4
