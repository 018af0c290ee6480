"""The micrograin model with other people's sampling, for comparison: not in the package."""

from __future__ import annotations

import drjit as dr

from asperity import models, plugin
from asperity.lobes import Lifted
from asperity.microfacet.ggx import normal_in_sphere_space, sample_visible_normal, smith_lambda
from asperity.microfacet.masking import smith_masking
from asperity.microfacet.numerics import log1p
from asperity.microfacet.sampling import reflect
from asperity.models.micrograin import Micrograin
from asperity.models.micrograin.grains import exposure
from asperity.models.micrograin.specular import Specular


class SampledOtherwise(Specular):
    """Grains whose half vector is drawn by ``normal``, with the density ``density``."""

    def eval_pdf(self, wi, wo):
        value, _ = super().eval_pdf(wi, wo)
        m = dr.normalize(wi + wo)
        return value, self.density(wi, m) / (4 * dr.dot(wi, m))

    def draw(self, wi, u, v):
        m = self.normal(wi, v)
        return reflect(wi, dr.normalize(type(wi)(self.grains.beta_x * m.x, self.grains.beta_y * m.y, m.z)))


class NDF(SampledOtherwise):
    """Normals by the NDF (Lucas 2024, Eq. 13 to 15)."""

    def normal(self, wi, v):
        r2 = log1p(-v.x * self.grains.tau_0) / log1p(-self.grains.tau_0)  # sin^2 in sphere space
        sin, cos = dr.sincos(2 * dr.pi * v.y)
        return type(wi)(dr.sqrt(r2) * cos, dr.sqrt(r2) * sin, dr.safe_sqrt(1 - r2))

    def density(self, wi, m):
        grains = self.grains
        h, d_ggx = normal_in_sphere_space(m, grains.beta_x, grains.beta_y)
        return dr.pi * grains.r * d_ggx * exposure(grains.r, h, 0) / grains.tau_0 * m.z


class GGX(SampledOtherwise):
    """Visible normals of GGX with roughness (beta_x, beta_y)."""

    def normal(self, wi, v):
        return sample_visible_normal(self.grains.to_sphere(wi), v.x, v.y)

    def density(self, wi, m):
        _, d_ggx = normal_in_sphere_space(m, self.grains.beta_x, self.grains.beta_y)
        return d_ggx * smith_masking(smith_lambda(self.grains.to_sphere(wi))) * dr.dot(wi, m) / wi.z


def sampled(kind):
    """The model for metal, with that lobe."""

    class Sampled(Micrograin):
        """Micrograin, sampled otherwise."""

        def lobes(self, si, active):
            (exact,) = (lifted.lobe for lifted in super().lobes(si, active))
            return [Lifted(kind(exact.grains, exact.material, exact.shaded), exact.grains.lift)]

    return Sampled


def register() -> None:
    """Make ``micrograin_ndf`` and ``micrograin_ggx`` known in the active variant."""
    models.MODELS |= {"micrograin_ndf": sampled(NDF), "micrograin_ggx": sampled(GGX)}
    plugin.register()
