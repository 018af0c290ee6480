"""Specular grains: what their mirror-like surface reflects once, and visible normals to sample it with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr

from ...lobes import Lobe
from ...microfacet.ggx import normal_in_sphere_space
from ...microfacet.sampling import reflect
from .grains import Grains, exposure
from .material import Material
from .shadows import Shadows, shadow


def reflected(grains: Grains, wi: Any, wo: Any, shaded: Callable[[Shadows, Any], Any]) -> tuple[Any, Any, Any, Any]:
    """(tau_0 D G / (4 cos_i), the same with G1(i) / tau_i for G, h, m) (Lucas 2024, Eq. 22, but for F).

    NDF and GAF share an exponential: tau_0 D G = pi r D_ggx exp(-r (pi (1 - h'^2) + U)) by Eq. 12 and 19, where U is
    the area in shadow on the plane at height h', by the choice of masking: ``shaded(shadows, h)``. With the shadow
    along i alone, G becomes G1, and what is reflected the density of samples by visible normals.
    """
    m = dr.normalize(wi + wo)
    h, d_ggx = normal_in_sphere_space(m, grains.beta_x, grains.beta_y)
    shadows = Shadows(grains.to_sphere(wi), grains.to_sphere(wo))
    most = dr.pi * grains.r * d_ggx / (4 * wi.z)
    seen = most * exposure(grains.r, h, shadow(shadows.i, h)) / grains.visible(wi)
    return most * exposure(grains.r, h, shaded(shadows, h)), seen, h, m


@dataclass
class Specular(Lobe):
    """The lobe of grains' surfaces (Lucas 2024, Eq. 22)."""

    grains: Grains
    material: Material
    shaded: Callable[[Shadows, Any], Any]

    def share(self, wi: Any) -> Any:
        """What is seen of grains, but for what is left to their diffuse lobe."""
        return self.grains.visible(wi) * (1 - self.material.diffuse_part(wi.z))

    def eval_pdf(self, wi: Any, wo: Any) -> tuple[Any, Any]:
        """tau_0 D G F / (4 cos_i), and the density of visible normals over 4 i.m."""
        value, pdf, h, m = reflected(self.grains, wi, wo, self.shaded)
        return self.material.reflectance(dr.dot(wi, m), h, m) * value, pdf

    def draw(self, wi: Any, u: Any, v: Any) -> Any:
        """Mirrored in a visible normal."""
        return reflect(wi, self.grains.visible_normal(wi, v.x, v.y))
