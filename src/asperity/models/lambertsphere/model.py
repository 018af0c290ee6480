"""BSDFs of half spaces of sparse particles, and the phase function of Lambertian spheres for participating media."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from ...lobes import Lobe, LobeModel, diffuse
from ...microfacet.albedo import directional_albedo
from ...microfacet.numerics import keep
from ...microfacet.sampling import about, spherical
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


class HalfSpace(LobeModel):
    """Sparse particles without end below the surface: what models of them share, by the functions they name here."""

    reflectance = Colour("Bond albedo of the material, as seen in uniform light", 0.5)
    albedo = Colour("albedo of the particles, instead of reflectance")

    once: Callable[[Any], Any]  # (cosine between propagation directions) -> density per steradian, to draw by
    draw_once: Callable[[Any], Any]  # (uniform number) -> such a cosine
    root: Callable[[Any], Any]  # (Bond albedo) -> s = sqrt(1 - albedo of the particles)

    def brdf(self, pair: Directions, s: Any) -> Any:
        """f_r per steradian, a spectrum."""
        raise NotImplementedError

    def configure(self, given: set[str]) -> None:
        """Settle which of the albedos is used."""
        conflict({"reflectance"} & given, {"albedo"} & given)
        setattr(self, "reflectance" if "albedo" in given else "albedo", None)

    def flags(self) -> list[int]:
        """One diffuse lobe."""
        return [diffuse()]

    def lobes(self, si: Any, active: Any) -> list[Lobe]:
        """All orders of scattering."""
        return [Particles(self.brdf, self.once, self.draw_once, self.s(si, active))]

    def s(self, si: Any, active: Any) -> Any:
        """s = sqrt(1 - c) in [0, 1], with a finite derivative at c = 1."""
        if self.reflectance is None:
            return dr.sqrt(keep(1 - self.at("albedo", si, active), transport.SMALL, 1))
        return self.root(self.at("reflectance", si, active))


@dataclass
class Particles(Lobe):
    """The lobe of a half space: drawn from what was scattered once, or by cosine.

    Once by a density like the phase function, as if the particle lay at the surface, and what goes down folded up. The
    density is exact, and it bounds the weight at grazing incidence, where f_r is unbounded.
    """

    brdf: Callable[[Directions, Any], Any]
    once: Callable[[Any], Any]
    draw_once: Callable[[Any], Any]
    s: Any

    def eval_pdf(self, wi: Any, wo: Any) -> tuple[Any, Any]:
        """(f cos_o, density)."""
        pair, chance = Directions.of(wi, wo), self.chance(wi)
        product = pair.u * pair.v
        once = self.once(-pair.q - product) + self.once(product - pair.q)  # up, and folded up
        return self.brdf(pair, self.s) * wo.z, chance * once + (1 - chance) * (wo.z / dr.pi)

    def draw(self, wi: Any, u: Any, v: Any) -> Any:
        """One or the other, by `chance`."""
        once = u < self.chance(wi)
        wo = spherical(dr.select(once, -self.draw_once(v.x), dr.sqrt(1 - v.x)), v.y)
        wo = dr.select(once, about(wi, wo), wo)
        return type(wo)(wo.x, wo.y, dr.abs(wo.z))

    def chance(self, wi: Any) -> Any:
        """Probability to draw single scattering, within 2 to 10 % of the best for each direction and albedo."""
        return dr.detach((1 - wi.z) * (0.4 + 0.5 * dr.mean(self.s * self.s)))


class LambertSphere(HalfSpace):
    """Sparse Lambertian spheres of any depth, for dust, soot, chalk and regolith (d'Eon 2021).

    Single scattering is exact, and all orders are there. ``accurate`` has new fits of the exact solution, ``published``
    those of the paper with its errors corrected, ``fast`` is one formula (Eq. 41). Spheres scatter light back: no
    limb darkening, saturated colours against the light.
    """

    citation = CITATION
    geometry = RandomWalk

    variant = Choice("fits of the exact solution", options=("accurate", "published", "fast"))

    once = staticmethod(transport.like_phase)
    draw_once = staticmethod(transport.sample_like_phase)

    def root(self, bond: Any) -> Any:
        """With the published fits, the published map."""
        return (transport.published_root if self.variant == "published" else transport.root)(bond)

    def brdf(self, pair: Directions, s: Any) -> Any:
        """By the function of the variant's name."""
        return getattr(transport, self.variant)(pair, s)

    def directional_albedo(self, si: Any, active: Any) -> Any:
        """Directional albedo, in closed form where there is one."""
        if self.variant == "accurate":
            return transport.directional_albedo(si.wi.z, self.s(si, active)) & (si.wi.z > 0)
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

    root = staticmethod(transport.isotropic_root)
    brdf = staticmethod(transport.isotropic)

    @staticmethod
    def once(cos: Any) -> Any:
        """The same in all directions."""
        return 0 * cos + dr.inv_four_pi

    @staticmethod
    def draw_once(u: Any) -> Any:
        """A cosine of any direction."""
        return 1 - 2 * u

    def directional_albedo(self, si: Any, active: Any) -> Any:
        """Directional albedo in closed form."""
        return transport.isotropic_directional_albedo(si.wi.z, self.s(si, active)) & (si.wi.z > 0)


class LambertSpherePhase(Declared):
    """Phase function of white Lambertian spheres in a participating medium (d'Eon 2021, Eq. 1).

    Normalised: the spheres' albedo is that of the medium. It depolarises, as Lambertian surfaces do.
    """

    citation = CITATION

    def eval_pdf(self, ctx: Any, mei: Any, wo: Any, active: Any) -> tuple[Any, Any]:
        """(value, solid-angle density of `sample`), which are the same; ``mei.wi`` points to where light goes."""
        pdf = transport.phase(-dr.dot(mei.wi, wo))
        return mi.UnpolarizedSpectrum(pdf) & active, dr.select(active, pdf, 0)

    def sample(self, ctx: Any, mei: Any, sample1: Any, sample2: Any, active: Any) -> tuple[Any, Any, Any]:
        """(direction, weight, density): the cosine by inversion, evenly in azimuth."""
        wo = dr.detach(mi.Frame3f(mei.wi).to_world(spherical(-transport.invert_phase(sample2.x), sample2.y)))
        return wo, mi.UnpolarizedSpectrum(1) & active, dr.detach(self.eval_pdf(ctx, mei, wo, active)[1])
