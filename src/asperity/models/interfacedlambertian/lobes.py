"""The two lobes: what facets mirror once, and what comes from the bodies below them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from ...lobes import Lobe
from ...microfacet.distributions import Distribution
from ...microfacet.sampling import about, choose, cosine_hemisphere, reflect
from .body import GRAZING, fresnel, interface, outer_reflectance
from .facets import Facets

FACING = 1 / 3
"""Share of the body's samples that are about a typical facet."""


def lift(w: Any) -> Any:
    """``w``, raised to a cosine of `GRAZING` at least."""
    return type(w)(w.x, w.y, dr.maximum(w.z, GRAZING))


def typical_cosine(distribution: Distribution, w: Any) -> Any:
    """Cosine at which facets are met along ``w``, roughly: rough ones face it more than the surface does."""
    tilt = dr.sqrt(dr.square(distribution.alpha_u * w.x) + dr.square(distribution.alpha_v * w.y) + 1e-14)
    return dr.minimum(w.z + tilt, 1)


def typical_normal(distribution: Distribution, w: Any) -> Any:
    """Normal of the facets seen along ``w``, in the mean of their slopes, roughly: of slopes that are Gaussian.

    Of deviation s along w they are s^2 tan(theta) from far above, and s sqrt(pi / 2) from the horizon.
    """
    x, y = dr.square(distribution.alpha_u) * w.x / 2, dr.square(distribution.alpha_v) * w.y / 2
    tilt = typical_cosine(distribution, w) - w.z
    return dr.normalize(type(w)(x, y, w.z + tilt / math.sqrt(math.pi)))


def mirrored_share(distribution: Distribution, n: Any, w: Any) -> Any:
    """Share of the light along ``w`` that facets mirror, roughly: F at a typical cosine.

    From low down, and on rough facets, a part is met at grazing incidence, where F is many times as large.
    """
    cos = typical_cosine(distribution, w)
    spread = (cos - w.z) / (2 * cos)
    return dr.lerp(fresnel(cos, n), fresnel(cos / 4, n), spread)


@dataclass
class Interface(Lobe):
    """The lobe of the interfaces (Eq. 4), drawn by visible normals."""

    distribution: Distribution
    facets: Facets
    n: Any

    def share(self, wi: Any) -> Any:
        """F at typical facets."""
        return mirrored_share(self.distribution, self.n, wi)

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
    """The lobe of the bodies below the interfaces (Eq. 13), drawn by cosine about the surface or a typical facet."""

    distribution: Distribution
    n: Any
    scale: Any  # Q, a spectrum
    light: Callable[[Any, Any, Any], Any]  # (wi, wo, Q) -> f per steradian

    def share(self, wi: Any) -> Any:
        """What typical facets let in, and out again."""
        inside = 1 - mirrored_share(self.distribution, self.n, wi)
        return inside * (1 - outer_reflectance(self.n)) * dr.mean(mi.UnpolarizedSpectrum(self.scale))

    def eval_pdf(self, wi: Any, wo: Any) -> tuple[Any, Any]:
        """(f cos_o, the mean of both cosines over pi)."""
        facing = dr.maximum(dr.dot(typical_normal(self.distribution, wi), wo), 0)
        density = dr.lerp(wo.z, facing, FACING) / dr.pi
        return self.light(wi, wo, self.scale) * wo.z, density

    def draw(self, wi: Any, u: Any, v: Any) -> Any:
        """By cosine."""
        facing, _ = choose(u, FACING)
        wo = cosine_hemisphere(v.x, v.y)
        return dr.select(facing, about(typical_normal(self.distribution, wi), wo), wo)
