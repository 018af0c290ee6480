"""BSDFs of half spaces of sparse particles, and the phase function of Lambertian spheres for participating media."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi

from ...loading import load
from ...microfacet.albedo import directional_albedo
from ...microfacet.numerics import clamp, keep
from ...parameters import Choice, Colour, Declared, conflict
from . import transport
from .microgeometry import RandomWalk
from .transport import Directions

CITATION = """\
@article{DEon2021LambertSphere,
  author    = {d'Eon, Eugene},
  title     = {An Analytic {BRDF} for Materials with Spherical {Lambertian} Scatterers},
  journal   = {Computer Graphics Forum},
  volume    = {40},
  number    = {4},
  year      = {2021},
  doi       = {10.1111/cgf.14348}
}"""
TINY = 1e-20


class HalfSpace(Declared):
    """Sparse particles without end below the surface: what models of them share, by the functions they name here.

    Sampling: what was scattered once by a lobe like the phase function, as if the particle lay at the surface, and what
    goes down folded up; the rest by cosine. The density is exact, and it bounds the weight at grazing incidence, where
    f_r is unbounded.
    """

    reflectance: Any
    albedo: Any

    lobe: Callable  # (cosine between propagation directions) -> density per steradian
    draw: Callable  # (uniform number) -> such a cosine
    root: Callable  # (Bond albedo) -> s = sqrt(1 - albedo of the particles)

    def brdf(self, pair: Directions, s):
        """f_r per steradian, a spectrum."""
        raise NotImplementedError

    def configure(self, given: set[str]) -> None:
        """Settle which of the albedos is used."""
        conflict({"reflectance"} & given, {"albedo"} & given)
        setattr(self, "reflectance" if "albedo" in given else "albedo", None)

    def components(self) -> list[int]:
        """One diffuse lobe."""
        return [int(mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide)]

    def eval_pdf(self, ctx, si, wo, active):
        """(f cos_o, solid-angle density of `sample`)."""
        wi, s = si.wi, self._root(si, active)
        active = active & (wi.z > 0) & (wo.z > 0) & ctx.is_enabled(mi.BSDFFlags.DiffuseReflection, 0)
        pair, chance = Directions.of(wi, wo), self._chance(wi, s)
        product = pair.u * pair.v
        once = self.lobe(-pair.q - product) + self.lobe(product - pair.q)  # up, and folded up
        pdf = chance * once + (1 - chance) * (wo.z / dr.pi)
        return dr.select(active, self.brdf(pair, s) * wo.z, 0), dr.select(active, pdf, 0)

    def sample(self, ctx, si, sample1, sample2, active):
        """Directions and densities carry no gradient: derivatives are those of the value at a fixed direction."""
        once = sample1 < self._chance(si.wi, self._root(si, active))
        wo = spherical(dr.select(once, -self.draw(sample2.x), dr.sqrt(1 - sample2.x)), sample2.y)
        wo = dr.select(once, mi.Frame3f(si.wi).to_world(wo), wo)
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = dr.detach(mi.Vector3f(wo.x, wo.y, dr.abs(wo.z)))
        bs.eta, bs.sampled_type = 1, mi.UInt32(self.components()[0])
        value, pdf = self.eval_pdf(ctx, si, bs.wo, active)
        bs.pdf = dr.detach(pdf)
        return bs, value / dr.maximum(bs.pdf, TINY) & (bs.pdf > 0)

    def _chance(self, wi, s):
        """Probability to sample single scattering, within 2 to 10 % of the best for each direction and albedo."""
        return dr.detach((1 - dr.clip(wi.z, 0, 1)) * (0.4 + 0.5 * dr.mean(s * s)))

    def _root(self, si, active):
        """s = sqrt(1 - c) in [0, 1], with a finite derivative at c = 1."""
        if self.reflectance is None:
            return dr.sqrt(keep(1 - clamp(self.albedo.eval(si, active), 0, 1), transport.SMALL, 1))
        return self.root(clamp(self.reflectance.eval(si, active), 0, 1))


class LambertSphere(HalfSpace):
    """Sparse Lambertian spheres of any depth, for dust, soot, chalk and regolith (d'Eon 2021).

    Single scattering is exact, and all orders are there. ``accurate`` has new fits of the exact solution, ``published``
    those of the paper with its errors corrected, ``fast`` is one formula (Eq. 41). Spheres scatter light back: no
    limb darkening, saturated colours against the light.
    """

    citation = CITATION

    reflectance = Colour("Bond albedo of the material, as seen in uniform light", 0.5)
    albedo = Colour("albedo of the particles, instead of reflectance")
    variant = Choice("fits of the exact solution", options=("accurate", "published", "fast"))

    lobe = staticmethod(transport.lobe)
    draw = staticmethod(transport.sample_lobe)

    @classmethod
    def microgeometry(cls, description: dict[str, Any]) -> RandomWalk:
        """The random walk between spheres that a scene's description of this BSDF stands for."""
        load(description)  # complains of what is wrong with it
        return RandomWalk.of(cls.defaults() | description, set(description))

    def root(self, bond):
        """With the published fits, the published map."""
        return (transport.published_root if self.variant == "published" else transport.root)(bond)

    def brdf(self, pair: Directions, s):
        """By the function of the variant's name."""
        return getattr(transport, self.variant)(pair, s)

    def directional_albedo(self, si, active):
        """Directional albedo, in closed form where there is one."""
        if self.variant == "accurate":
            return transport.directional_albedo(si.wi.z, self._root(si, active)) & (si.wi.z > 0)
        return directional_albedo(self.sample, si, active, 256)


class Chandrasekhar(HalfSpace):
    """Sparse particles that scatter evenly, for instance mirror spheres in an absorbing medium (Chandrasekhar 1960)."""

    citation = """\
@book{Chandrasekhar1960RadiativeTransfer,
  author    = {Chandrasekhar, Subrahmanyan},
  title     = {Radiative Transfer},
  publisher = {Dover},
  year      = {1960}
}"""

    reflectance, albedo = LambertSphere.reflectance, LambertSphere.albedo

    root = staticmethod(transport.isotropic_root)
    brdf = staticmethod(transport.isotropic)

    @staticmethod
    def lobe(cos):
        """The same in all directions."""
        return 0 * cos + dr.inv_four_pi

    @staticmethod
    def draw(u):
        """A cosine of any direction."""
        return 1 - 2 * u

    def directional_albedo(self, si, active):
        """Directional albedo in closed form."""
        return transport.isotropic_directional_albedo(si.wi.z, self._root(si, active)) & (si.wi.z > 0)


class LambertSpherePhase(Declared):
    """Phase function of white Lambertian spheres in a participating medium (d'Eon 2021, Eq. 1).

    Normalised: the spheres' albedo is that of the medium. It depolarises, as Lambertian surfaces do.
    """

    citation = CITATION

    def eval_pdf(self, ctx, mei, wo, active):
        """(value, solid-angle density of `sample`), which are the same; ``mei.wi`` points to where light goes."""
        pdf = transport.phase(-dr.dot(mei.wi, wo))
        return mi.UnpolarizedSpectrum(pdf) & active, dr.select(active, pdf, 0)

    def sample(self, ctx, mei, sample1, sample2, active):
        """(direction, weight, density): the cosine by inversion, evenly in azimuth."""
        wo = dr.detach(mi.Frame3f(mei.wi).to_world(spherical(-transport.invert_phase(sample2.x), sample2.y)))
        return wo, mi.UnpolarizedSpectrum(1) & active, dr.detach(self.eval_pdf(ctx, mei, wo, active)[1])


def spherical(cos, u):
    """The direction at this cosine with the z axis, at an azimuth given by ``u`` in [0, 1)."""
    (sin_azimuth, cos_azimuth), sin = dr.sincos(2 * dr.pi * u), dr.safe_sqrt(1 - cos * cos)
    return mi.Vector3f(sin * cos_azimuth, sin * sin_azimuth, cos)
