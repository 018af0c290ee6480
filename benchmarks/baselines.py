"""The micrograin model with other people's sampling, for comparison: not in the package."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from asperity import models, plugin
from asperity.microfacet.numerics import log1p
from asperity.models.micrograin import Micrograin, smith
from asperity.models.micrograin.grains import exposure, normal_in_sphere_space


class SampledOtherwise(Micrograin):
    """Specular grains whose half vector has the density ``self.density_of_normals``."""

    declarations = classmethod(lambda cls: Micrograin.declarations())

    def _specular(self, si, active, grains, wi, wo):
        value, _ = super()._specular(si, active, grains, wi, wo)
        m = dr.normalize(wi + wo)
        return value, self.density_of_normals(grains, wi, m) / (4 * dr.dot(wi, m))


class NDF(SampledOtherwise):
    """Normals by the NDF (Lucas 2024, Eq. 13 to 15)."""

    def _visible_normal(self, grains, wi, sample2):
        r2 = log1p(-sample2.x * grains.tau_0) / log1p(-grains.tau_0)  # sin^2 in sphere space
        sin, cos = dr.sincos(2 * dr.pi * sample2.y)
        x, y = dr.sqrt(r2) * cos, dr.sqrt(r2) * sin
        return dr.normalize(mi.Normal3f(grains.beta_x * x, grains.beta_y * y, dr.safe_sqrt(1 - r2)))

    def density_of_normals(self, grains, wi, m):
        h, d_ggx = normal_in_sphere_space(m, grains.beta_x, grains.beta_y)
        return dr.pi * grains.r * d_ggx * exposure(grains.r, h, 0) / grains.tau_0 * m.z


class GGX(SampledOtherwise):
    """Visible normals of GGX with roughness (beta_x, beta_y)."""

    def _visible_normal(self, grains, wi, sample2):
        m = smith.sample_visible_normal(grains.to_sphere(wi), sample2.x, sample2.y)
        return dr.normalize(mi.Normal3f(grains.beta_x * m.x, grains.beta_y * m.y, m.z))

    def density_of_normals(self, grains, wi, m):
        _, d_ggx = normal_in_sphere_space(m, grains.beta_x, grains.beta_y)
        return d_ggx * smith.visible_masking(grains.to_sphere(wi)) * dr.dot(wi, m) / wi.z


def register() -> None:
    """Make ``micrograin_ndf`` and ``micrograin_ggx`` known in the active variant."""
    models.MODELS |= {"micrograin_ndf": NDF, "micrograin_ggx": GGX}
    plugin.register()
