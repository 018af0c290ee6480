"""Grains with Smith's masking: heights independent of normals, and of each other (Lucas et al. 2023).

The published baseline of the micrograin model, as Lucas 2024 recalls it in Eq. 1 to 6. Two pieces are not printed there
and were filled in: the masking function follows from Smith's condition that the visible normals project to the whole
surface, and the transmission T of a coated grain is taken for the macroscopic angles.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr

from ...lobes import Lobe
from ...microfacet.ggx import inclination, normal_in_sphere_space, sample_visible_normal, smith_lambda
from ...microfacet.masking import smith_masking
from ...microfacet.numerics import one_minus_exp
from ...microfacet.quadrature import integrate
from ...microfacet.sampling import cosine_hemisphere, reflect
from .grains import Grains, exposure
from .material import Material
from .pores import Pores
from .shadows import silhouette

HEIGHTS = 12


def masking(r: Any, w: Any) -> Any:
    """G1(w) = cos / int D(m) (w.m)+ dm, for ``w`` in sphere space."""
    sin, cos = inclination(w)

    def width(
        h: Any, captured: tuple[Any, Any, Any]
    ) -> tuple[Any]:  # int (w.m')+ over the azimuth, of what is exposed at height h
        r, sin, cos = captured
        _, sin_alpha, gamma = silhouette(sin, cos, h)
        return (2 * (cos * h * (dr.pi - gamma) + sin * sin_alpha) * exposure(r, h, 0),)

    (projected,) = integrate(width, HEIGHTS, (r, sin, cos), r * cos)
    return dr.minimum(cos * filling_factor(r) / (r * projected), 1)


def masking_shadowing(r: Any, i: Any, o: Any) -> Any:
    """G1(i) G1(o) w+(i, o) / tau_0: the filling factor of Lucas 2024, Eq. 20 was w+ before."""
    return masking(r, i) * masking(r, o) * grain_weight(r, i, o) / filling_factor(r)


def filling_factor(r: Any) -> Any:
    """tau_0."""
    return one_minus_exp(dr.pi * r)


def grain_weight(r: Any, i: Any, o: Any) -> Any:
    """w+(i, o), the share of the grains among what both directions see (Lucas 2023; 2024, Eq. 4)."""
    return one_minus_exp(_pore_depth(r, i, o))


def pore_weight(r: Any, i: Any, o: Any) -> Any:
    """1 - w+(i, o) = (1 - tau_i) (1 - tau_o) / (1 - tau_0)."""
    return dr.exp(-_pore_depth(r, i, o))


def _pore_depth(r: Any, i: Any, o: Any) -> Any:
    """All three factors are exponentials."""
    return r * (dr.pi / 2) * (1 / inclination(i)[1] + 1 / inclination(o)[1])


@dataclass
class SmithSpecular(Lobe):
    """The lobe of grains' surfaces; sampled by the visible normals of GGX, whose D theirs is like."""

    grains: Grains
    material: Material

    def share(self, wi: Any) -> Any:
        """As with all masking."""
        return self.grains.visible(wi) * (1 - self.material.diffuse_part(wi.z))

    def eval_pdf(self, wi: Any, wo: Any) -> tuple[Any, Any]:
        """w+ D G F / (4 cos_i) (Lucas 2024, Eq. 1 and 5), and the density of visible normals over 4 i.m."""
        grains, m = self.grains, dr.normalize(wi + wo)
        i, o = grains.to_sphere(wi), grains.to_sphere(wo)
        h, d_ggx = normal_in_sphere_space(m, grains.beta_x, grains.beta_y)
        value = dr.pi * grains.r * d_ggx * exposure(grains.r, h, 0) * masking_shadowing(grains.r, i, o) / (4 * wi.z)
        return self.material.reflectance(dr.dot(wi, m), h, m) * value, d_ggx * smith_masking(smith_lambda(i)) / (
            4 * wi.z
        )

    def draw(self, wi: Any, u: Any, v: Any) -> Any:
        """Mirrored in a visible normal."""
        m = sample_visible_normal(self.grains.to_sphere(wi), v.x, v.y)
        return reflect(wi, dr.normalize(type(wi)(self.grains.beta_x * m.x, self.grains.beta_y * m.y, m.z)))


@dataclass
class SmithLambertian(Lobe):
    """The lobe of diffuse grains, which are flat here; sampled by cosine."""

    grains: Grains
    material: Material

    def share(self, wi: Any) -> Any:
        """As with all masking."""
        return self.grains.visible(wi) * self.material.diffuse_part(wi.z)

    def eval_pdf(self, wi: Any, wo: Any) -> tuple[Any, Any]:
        """w+ T K_d cos_o / pi (Lucas 2024, Eq. 3 and 4), and the cosine over pi."""
        coat, cosine = self.material.coat, wo.z / dr.pi
        weight = grain_weight(self.grains.r, self.grains.to_sphere(wi), self.grains.to_sphere(wo))
        through = (1 - coat(wi.z)) * (1 - coat(wo.z)) if coat else 1
        return self.material.albedo * (weight * through * cosine), cosine

    def draw(self, wi: Any, u: Any, v: Any) -> Any:
        """By cosine."""
        return cosine_hemisphere(v.x, v.y)


class SmithPores(Pores):
    """How the base is seen between grains: by 1 - w+."""

    def both(self, i: Any, o: Any) -> Any:
        """1 - w+(i, o)."""
        return pore_weight(self.grains.r, i, o)
