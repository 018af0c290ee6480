"""Models with other people's sampling, for comparison: not in the package."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from asperity import models, plugin
from asperity.lobes import Lifted, above
from asperity.microfacet.ggx import normal_in_sphere_space, sample_visible_normal, smith_lambda
from asperity.microfacet.masking import smith_masking
from asperity.microfacet.numerics import log1p
from asperity.microfacet.sampling import cosine_hemisphere, more_numbers, reflect
from asperity.models.interfacedlambertian import InterfacedLambertian
from asperity.models.interfacedlambertian.body import outer_reflectance, transmitted_twice
from asperity.models.interfacedlambertian.lobes import Body, Interface
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


class PublishedInterface(Interface):
    """Normals by the NDF, chosen as often as a flat interface mirrors (Meneveaux et al. 2018, Sec. 4.1, Eq. 26)."""

    def share(self, wi):
        return outer_reflectance(self.n)

    def eval_pdf(self, wi, wo):
        m = dr.normalize(wi + wo)
        return super().eval_pdf(wi, wo)[0], self.distribution.sample_density(m) / (4 * dr.dot(wi, m))

    def draw(self, wi, u, v):
        return reflect(wi, self.distribution.sample(v.x, v.y))


class PublishedBody(Body):
    """By cosine, and one random facet by the NDF in place of the integral (Meneveaux et al. 2018, Eq. 27 and 28)."""

    def share(self, wi):
        return dr.square(1 - outer_reflectance(self.n)) * dr.mean(mi.UnpolarizedSpectrum(self.scale))

    def eval_pdf(self, wi, wo):
        u, v, _ = more_numbers(*(wo / 2 + 0.5))
        m = self.distribution.sample(u, v)
        facing_i, facing_o = dr.dot(wi, m), dr.dot(wo, m)
        lit = self.facets.lit(facing_i, facing_o, wi.z, wo.z, m.z) * self.facets.masking(self.distribution, wi, wo)
        ratio = self.distribution.density(m) / self.distribution.sample_density(m)
        once = transmitted_twice(facing_i, facing_o, self.n) * lit * ratio / (wi.z * wo.z)
        return self.scale * (once / dr.pi * wo.z), wo.z / dr.pi

    def draw(self, wi, u, v):
        return cosine_hemisphere(v.x, v.y)


class Published(InterfacedLambertian):
    """Interfaced facets, sampled as published: each lobe is weighted by its own density."""

    def lobes(self, si, active):
        interface, body = (lifted.lobe for lifted in super().lobes(si, active))
        kinds = PublishedInterface(**vars(interface)), PublishedBody(**vars(body))
        return [Lifted(lobe, lifted.lift) for lobe, lifted in zip(kinds, super().lobes(si, active))]

    def sample(self, ctx, si, sample1, sample2, active):
        bs, weight = super().sample(ctx, si, sample1, sample2, active)
        here = self._here(ctx, si, active)
        for n, chance in here.chances.items():
            value, pdf = here.lobes[n].eval_pdf(above(si.wi), above(bs.wo))
            ours = mi.UnpolarizedSpectrum(value) / (chance * pdf)
            weight = dr.select((bs.sampled_component == n) & (bs.pdf > 0), ours, weight)
        return bs, weight


def register() -> None:
    """Make them known in the active variant."""
    models.MODELS |= {"micrograin_ndf": sampled(NDF), "micrograin_ggx": sampled(GGX)}
    models.MODELS |= {"interfacedlambertian_published": Published}
    plugin.register()
