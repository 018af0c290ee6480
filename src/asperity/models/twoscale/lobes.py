"""The two lobes: what facets mirror, and what the finer roughness on them diffracts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr

from ...lobes import Lobe
from ...microfacet.distributions import EPD
from ...microfacet.masking import (
    azimuth_between,
    cavity_visible_density,
    sample_cavity_visible_normal,
    smith_direction_correlated,
    smith_height_correlated,
    smith_separable,
)
from ...microfacet.numerics import heading, one_minus_exp
from ...microfacet.sampling import reflect
from .diffraction import Disc, phase, scale
from .tables import Known

GRAZING = 1e-6
"""Least cosine of a direction: that of float32 next to the horizon."""
MASKING: dict[str, Callable[[Any, Any, Any, Any], Any]] = {
    "direction": lambda i, o, wi, wo: smith_direction_correlated(i, o, azimuth_between(wi, wo)),
    "height": lambda i, o, wi, wo: smith_height_correlated(i, o),
    "separable": lambda i, o, wi, wo: smith_separable(i, o),
}
"""G of Smith's Lambda along both directions, by the name that a scene uses."""


def lift(w: Any) -> Any:
    """``w``, raised to a cosine of `GRAZING` at least."""
    return type(w)(w.x, w.y, dr.maximum(w.z, GRAZING))


def half(wi: Any, wo: Any) -> tuple[Any, Any]:
    """(half vector h, cosine between it and either direction)."""
    whole = wi + wo
    length = dr.norm(whole)
    return whole / length, dr.minimum(length / 2, 1)


@dataclass
class Surface:
    """What both lobes need, at a surface point."""

    facets: EPD
    masking: str
    sigma: Any
    b: Any
    c: Any
    wavelengths: Any  # a spectrum
    known: Known

    def shadowing(self, wi: Any, wo: Any) -> Any:
        """G."""
        return MASKING[self.masking](self.facets.smith_lambda(wi), self.facets.smith_lambda(wo), wi, wo)

    def exponent(self, cos_d: Any) -> Any:
        """-log A, as a spectrum."""
        return phase(self.sigma, cos_d, self.wavelengths) * self.known.R.at(self.wavelengths, cos_d)

    def kept(self, cos_d: Any) -> Any:
        """Share of the light that stays in the mirror direction: A, or what conserves energy in its place."""
        lost = self.known.lost
        if lost is None:
            return dr.exp(-self.exponent(cos_d))
        k = dr.sqrt(phase(self.sigma, 1, self.wavelengths))
        found = [lost.one(n, w, k[n] / (1 + k[n]), cos_d) for n, w in enumerate(self.wavelengths)]
        return dr.exp(-dr.square(k) * type(k)(found))

    def diffracted(self, h: Any, cos_d: Any) -> Any:
        """(1 - A) (S * D)(h) per steradian, a spectrum."""
        B, R = self.b / self.wavelengths, self.known.R.at(self.wavelengths, cos_d)
        share = one_minus_exp(phase(self.sigma, cos_d, self.wavelengths) * R)
        return share * scale(B, self.c, R) * self.known.convolved.at(self.c, B * cos_d, h)

    def broadening(self, cos: Any) -> Any:
        """Width in direction cosines that facets give what is diffracted from light of this cosine."""
        facets = self.facets
        alpha = dr.sqrt((dr.square(facets.alpha_u) + dr.square(facets.alpha_v)) / 2)
        return 2 * cos * alpha * self.known.median

    def mirrored(self, cos: Any) -> Any:
        """Chance to draw what is mirrored: the mean of A, more where facets broaden all; never all or nothing.

        Of grazing light little is diffracted, but that goes up, where more would be.
        """
        A, upright = (dr.mean(dr.exp(-self.exponent(x))) for x in (cos, 1 + 0 * cos))
        x = 2 * self.frequency() * self.broadening(cos)
        broad = x / (1 + x)
        return dr.detach(dr.clip(A + 0.3 * (1 - A) * broad, 0.1, dr.maximum(upright, 0.9)))

    def frequency(self) -> Any:
        """B of a typical wavelength."""
        return self.b / self.known.bands.typical

    def disc(self, w: Any) -> Disc:
        """Where light from ``w`` goes that is diffracted, roughly: the power spectrum, broadened by the facets."""
        B = dr.rsqrt(dr.square(1 / self.frequency()) + dr.square(self.broadening(w.z)))
        return Disc(dr.sqrt(dr.maximum(1 - dr.square(w.z), 0)), B, self.c)


@dataclass
class Mirrored(Lobe):
    """A F D G / (4 cos_i cos_o), drawn by visible normals of V-cavities."""

    surface: Surface
    fresnel: Callable[[Any], Any]

    def share(self, wi: Any) -> Any:
        """See `Surface.mirrored`."""
        return self.surface.mirrored(wi.z)

    def eval_pdf(self, wi: Any, wo: Any) -> tuple[Any, Any]:
        """(f cos_o, the density of visible normals over 4 cos_d)."""
        (h, cos_d), surface = half(wi, wo), self.surface
        value = surface.facets.density(h) * surface.shadowing(wi, wo) / (4 * wi.z)
        density = cavity_visible_density(surface.facets, wi, h) / (4 * cos_d)
        return surface.kept(cos_d) * (self.fresnel(cos_d) * value), density

    def draw(self, wi: Any, u: Any, v: Any) -> Any:
        """Mirrored in a visible normal."""
        return reflect(wi, sample_cavity_visible_normal(self.surface.facets, wi, v.x, v.y, u)[0])


@dataclass
class Diffracted(Lobe):
    """(1 - A) F G (S * D), drawn from the disc of directions."""

    surface: Surface
    fresnel: Callable[[Any], Any]

    def share(self, wi: Any) -> Any:
        """What is not mirrored."""
        return 1 - self.surface.mirrored(wi.z)

    def eval_pdf(self, wi: Any, wo: Any) -> tuple[Any, Any]:
        """(f cos_o, density)."""
        (h, cos_d), surface = half(wi, wo), self.surface
        r = dr.sqrt(dr.square(wi.x + wo.x) + dr.square(wi.y + wo.y) + 1e-14)
        value = self.fresnel(cos_d) * (surface.shadowing(wi, wo) * wo.z)
        return surface.diffracted(h, cos_d) * value, surface.disc(wi).density(r) * wo.z

    def draw(self, wi: Any, u: Any, v: Any) -> Any:
        """At a distance from the mirror direction in the disc, and an azimuth around it within the disc."""
        disc, (x, y) = self.surface.disc(wi), heading(wi.x, wi.y)
        r = disc.radius(v.x)
        sin, cos = dr.sincos((2 * v.y - 1) * disc.reach(r))
        along, across = r * cos - disc.sin, r * sin
        up = dr.sqrt(dr.maximum(1 - dr.square(along) - dr.square(across), 0))
        return type(wi)(along * x - across * y, along * y + across * x, up)
