"""Rough diffuse reflection from V-grooves of Lambertian facets (Oren and Nayar 1994)."""

from __future__ import annotations

from typing import Any

import drjit as dr

from ...lobes import ByCosine, Lobe, LobeModel, diffuse
from ...microfacet.numerics import TINY, clamp
from ...parameters import Choice, Colour, Texture, Usual


class OrenNayar(LobeModel):
    """Oren and Nayar 1994: Lambertian V-grooves whose facets' tilts are distributed normally.

    ``full`` fits the integrals of single scattering, and light that bounces twice in a groove; ``qualitative`` is the
    simpler fit that renderers use, of single scattering alone. Sampled by cosine.
    """

    citation = """\
@inproceedings{Oren1994Lambert,
  author    = {Oren, Michael and Nayar, Shree K.},
  title     = {Generalization of {Lambert's} Reflectance Model},
  booktitle = {Proceedings of SIGGRAPH 94},
  pages     = {239--246},
  year      = {1994},
  doi       = {10.1145/192161.192213}
}"""

    reflectance = Colour("albedo of the facets", 0.5)
    sigma = Texture("standard deviation of the facets' tilt", 20.0, high=90, unit="degree", usually=Usual(0, 45))
    variant = Choice("the model, or its simpler fit", options=("full", "qualitative"))

    def flags(self) -> list[int]:
        """One diffuse lobe."""
        return [diffuse()]

    def lobes(self, si: Any, active: Any) -> list[Lobe]:
        """The model, drawn by cosine."""
        brdf = full if self.variant == "full" else qualitative
        tilt, albedo = dr.deg2rad(self.at("sigma", si, active)), self.at("reflectance", si, active)
        return [ByCosine(lambda wi, wo: brdf(wi, wo, tilt * tilt, albedo))]


def angles(wi: Any, wo: Any) -> tuple[Any, ...]:
    """(cos alpha, cos beta, sin alpha, sin beta, q) of two unit vectors above the surface.

    alpha is the larger angle with the normal, beta the smaller one, and q = sin(alpha) sin(beta) cos(phi).
    """
    sin_i, sin_o = (dr.sqrt(dr.square(w.x) + dr.square(w.y) + TINY) for w in (wi, wo))
    cos_i, cos_o = (dr.maximum(w.z, 1e-4) for w in (wi, wo))
    steep = cos_i < cos_o
    sines = dr.select(steep, sin_i, sin_o), dr.select(steep, sin_o, sin_i)
    return dr.minimum(cos_i, cos_o), dr.maximum(cos_i, cos_o), *sines, wi.x * wo.x + wi.y * wo.y


def qualitative(wi: Any, wo: Any, variance: Any, albedo: Any) -> Any:
    """f_r per steradian (Oren and Nayar 1994, the qualitative model), for the variance of the tilt in radians."""
    _, cos_beta, _, _, q = angles(wi, wo)
    a, b = 1 - 0.5 * variance / (variance + 0.33), 0.45 * variance / (variance + 0.09)
    return albedo / dr.pi * (a + b * dr.maximum(q, 0) / cos_beta)


def full(wi: Any, wo: Any, variance: Any, albedo: Any) -> Any:
    """f_r per steradian (Oren and Nayar 1994, the functional approximation), for the variance of the tilt in radians.

    sin(alpha) cos(phi) tan(beta) = q / cos(beta), and tan((alpha + beta) / 2) is the sines' sum over the cosines'.
    """
    cos_alpha, cos_beta, sin_alpha, sin_beta, q = angles(wi, wo)
    alpha, beta = (2 / dr.pi * dr.atan2(s, c) for s, c in ((sin_alpha, cos_alpha), (sin_beta, cos_beta)))
    cos_phi = dr.clip(q / (sin_alpha * sin_beta), -1, 1)
    c1, c2 = 1 - 0.5 * variance / (variance + 0.33), 0.45 * variance / (variance + 0.09)
    c2 = c2 * dr.select(q >= 0, 1, 1 - beta**3 / sin_alpha)
    c3 = 0.125 * variance / (variance + 0.09) * dr.square(alpha * beta)
    half = (sin_alpha + sin_beta) / (cos_alpha + cos_beta)
    once = c1 + c2 * q / cos_beta + c3 * (1 - dr.abs(cos_phi)) * half
    twice = 0.17 * variance / (variance + 0.13) * (1 - cos_phi * dr.square(beta))
    # From 45 degrees on, the fit is negative where it is small: -9e-4 at the worst.
    return clamp(albedo / dr.pi * (once + albedo * twice), 0, dr.inf)
