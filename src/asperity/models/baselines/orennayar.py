"""Rough diffuse reflection from V-grooves of Lambertian facets (Oren and Nayar 1994)."""

from __future__ import annotations

from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi

from ...microfacet.numerics import clamp
from ...parameters import Choice, Colour, Declared, Texture

CITATION = """\
@inproceedings{Oren1994Lambert,
  author    = {Oren, Michael and Nayar, Shree K.},
  title     = {Generalization of {Lambert's} Reflectance Model},
  booktitle = {Proceedings of SIGGRAPH 94},
  pages     = {239--246},
  year      = {1994},
  doi       = {10.1145/192161.192213}
}"""
TINY = 1e-20


class OrenNayar(Declared):
    """Oren and Nayar 1994: Lambertian V-grooves whose facets' tilts are distributed normally.

    ``full`` fits the integrals of single scattering, and light that bounces twice in a groove; ``qualitative`` is the
    simpler fit that renderers use, of single scattering alone. Sampled by cosine.
    """

    citation = CITATION

    reflectance = Colour("albedo of the facets", 0.5)
    sigma = Texture("standard deviation of the facets' tilt", 20.0, high=90, unit="degree")
    variant = Choice("the model, or its simpler fit", options=("full", "qualitative"))

    def components(self) -> list[int]:
        """One diffuse lobe."""
        return [int(mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide)]

    def eval_pdf(self, ctx, si, wo, active):
        """(f cos_o, cos_o / pi)."""
        active = active & (si.wi.z > 0) & (wo.z > 0) & ctx.is_enabled(mi.BSDFFlags.DiffuseReflection, 0)
        sigma, albedo = dr.deg2rad(self.number("sigma", si, active)), self.reflectance.eval(si, active)
        f = (full if self.variant == "full" else qualitative)(Angles.of(si.wi, wo), sigma * sigma, albedo)
        return dr.select(active, f * wo.z, 0), dr.select(active, wo.z / dr.pi, 0)

    def sample(self, ctx, si, sample1, sample2, active):
        """By cosine."""
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = mi.warp.square_to_cosine_hemisphere(sample2)
        bs.eta, bs.sampled_type = 1, mi.UInt32(self.components()[0])
        value, bs.pdf = self.eval_pdf(ctx, si, bs.wo, active)
        return bs, value / dr.maximum(bs.pdf, TINY) & (bs.pdf > 0)


class Angles(NamedTuple):
    """Two directions: alpha is the larger angle with the normal, beta the smaller one."""

    cos_alpha: Any
    cos_beta: Any
    sin_alpha: Any
    sin_beta: Any
    q: Any  # sin(alpha) sin(beta) cos(phi)

    @classmethod
    def of(cls, wi, wo) -> Angles:
        """The angles of two vectors; those below the horizon are meaningless, and masked by the caller."""
        sin_i, sin_o = (dr.sqrt(dr.maximum(dr.square(w.x) + dr.square(w.y), TINY)) for w in (wi, wo))
        cos_i, cos_o = (dr.clip(w.z, 1e-4, 1) for w in (wi, wo))
        steep = cos_i < cos_o
        return cls(
            dr.minimum(cos_i, cos_o),
            dr.maximum(cos_i, cos_o),
            dr.select(steep, sin_i, sin_o),
            dr.select(steep, sin_o, sin_i),
            wi.x * wo.x + wi.y * wo.y,
        )


def qualitative(angles: Angles, variance, albedo):
    """f_r per steradian (Oren and Nayar 1994, the qualitative model), for the variance of the tilt in radians."""
    a, b = 1 - 0.5 * variance / (variance + 0.33), 0.45 * variance / (variance + 0.09)
    return albedo / dr.pi * (a + b * dr.maximum(angles.q, 0) / angles.cos_beta)


def full(angles: Angles, variance, albedo):
    """f_r per steradian (Oren and Nayar 1994, the functional approximation), for the variance of the tilt in radians.

    sin(alpha) cos(phi) tan(beta) = q / cos(beta), and tan((alpha + beta) / 2) is the sines' sum over the cosines'.
    """
    cos_alpha, cos_beta, sin_alpha, sin_beta, q = angles
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
