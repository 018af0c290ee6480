"""The V-groove BSDF (Lee et al. 2018): parameters, evaluation and sampling."""

from __future__ import annotations

import warnings
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ...conductors import Conductor
from ...errors import ParameterError
from ...loading import load
from ...microfacet.distributions import DISTRIBUTIONS, Distribution
from ...microfacet.fresnel import conductor
from ...microfacet.numerics import clamp
from ...microfacet.sampling import more_numbers
from ...parameters import Choice, Declared, Flag, Integer, Texture, conflict, numbers, varies
from .bounces import MOST, needed_bounces, needed_bounces_nonsymmetric
from .fresnel import Reflectance, fit
from .kaleidoscope import Groove, Pair, bounces, entrance, exit_angle, symmetric_bounces
from .microgeometry import ExplicitGrooves
from .nonsymmetric import nonsymmetric
from .symmetric import symmetric
from .tilts import Tilts

CITATION = """\
@article{Lee2018Practical,
  author  = {Lee, Joo Ho and Jarabo, Adrian and Jeon, Daniel S. and Gutierrez, Diego and Kim, Min H.},
  title   = {Practical Multiple Scattering for Rough Surfaces},
  journal = {ACM Transactions on Graphics},
  volume  = {37},
  number  = {6},
  pages   = {275},
  year    = {2018},
  doi     = {10.1145/3272127.3275016}
}"""
SMOOTHEST = 1e-3
TINY = 1e-20


class VGroove(Declared):
    """Metal whose microfacets pair up to V-shaped grooves, in which light is reflected as often as it takes.

    Exact for its geometry, without noise, tables or fits. Facets of equal tilt (``symmetric``, a closed form, fast)
    leave a sharp glint in the mirror direction, whatever the roughness; facets of independent tilts soften it, by
    quadrature.
    """

    citation = CITATION

    distribution = Choice("distribution of the facets' normals", options=tuple(DISTRIBUTIONS))
    alpha = Texture("roughness, never squared; at most 1 for Phong", 0.3, low=SMOOTHEST, high=1e3)
    alpha_u = Texture("roughness along x, instead of alpha", None, low=SMOOTHEST, high=1e3)
    alpha_v = Texture("roughness along y, instead of alpha", None, low=SMOOTHEST, high=1e3)
    exponent = Texture("Phong's exponent, instead of alpha: 2 / alpha² - 2", None, high=1e6)
    metal = Conductor("metal of the facets", "none")
    symmetric = Flag("whether both facets of a groove have the same tilt, or independent ones", True)
    max_bounces = Integer("more often bounced light is lost; by default 0.1 % of it, or less", None, low=1, high=MOST)

    @classmethod
    def microgeometry(cls, description: dict[str, Any]) -> ExplicitGrooves:
        """The explicit grooves that a scene's description of this BSDF stands for."""
        load(description)  # complains of what is wrong with it
        return ExplicitGrooves.of(cls.defaults() | description, set(description))

    def configure(self, given: set[str]) -> None:
        """Settle which of the roughnesses is used."""
        conflict({"alpha"} & given, {"alpha_u", "alpha_v", "exponent"} & given)
        conflict({"exponent"} & given, {"alpha_u", "alpha_v"} & given)
        if "exponent" in given and self.distribution != "phong":
            raise ParameterError(f"exponent: Phong's, but distribution = {self.distribution!r}; give alpha instead.")
        self.isotropic = not {"alpha_u", "alpha_v"} & given
        self.axes = ["alpha" if getattr(self, name) is None else name for name in ("alpha_u", "alpha_v")]
        self.axes = [] if self.exponent else self.axes
        for name in ("alpha", "alpha_u", "alpha_v"):
            if name not in self.axes:
                setattr(self, name, None)
        self.check()

    def check(self) -> None:
        """Ranges, and Phong's own."""
        super().check()
        for name in ("alpha", "alpha_u", "alpha_v"):
            if (alpha := getattr(self, name)) is not None and self.distribution == "phong":
                high = max((shown.max() for _, shown in numbers(alpha)), default=0)
                if high > 1:
                    raise ParameterError(
                        f"{name} = {high:g}: expected a number or texture in [{SMOOTHEST:g}, 1] for Phong."
                    )

    def ranges(self) -> dict[str, tuple[float, float]]:
        """Phong's roughness ends at 1."""
        largest = DISTRIBUTIONS[self.distribution].largest
        found = super().ranges()
        return found | {name: (low, min(high, largest)) for name, (low, high) in found.items() if "alpha" in name}

    def components(self) -> list[int]:
        """One glossy lobe."""
        anisotropic = 0 if self.isotropic else mi.BSDFFlags.Anisotropic
        return [int(mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide | anisotropic)]

    def update(self) -> None:
        """Bring up to date what is made from the parameters."""
        needed, alpha = needed_bounces if self.symmetric else needed_bounces_nonsymmetric, self._roughest()
        most = self.max_bounces or (MOST if alpha is None else needed(DISTRIBUTIONS[self.distribution], alpha))
        if alpha is not None and not self.max_bounces and most == MOST:
            lost = f"alpha = {alpha:g}: more than 0.1 % of the light bounces over {MOST} times, and is lost."
            warnings.warn(lost, stacklevel=2)
        self.most = dr.opaque(mi.UInt32, most) if dr.is_jit_v(mi.Float) else most
        self.logarithm = self._constant_logarithm()

    def eval_pdf(self, ctx, si, wo, active):
        """(f |cos_o|, solid-angle density of `sample`), which is the same for mirrors."""
        black = mi.UnpolarizedSpectrum(0), mi.Float(0)
        if not ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0):
            return black
        active = active & (si.wi.z > 0) & (wo.z > 0)
        wi, wo = (dr.select(active, w, mi.Vector3f(0, 0, 1)) for w in (si.wi, wo))
        pair = Pair.of(wi, wo)
        tilts = Tilts.along(self._distribution(si, active), pair.cos_azimuth, pair.sin_azimuth)
        brdf = symmetric if self.symmetric else nonsymmetric
        value, pdf = brdf(pair, wi.z, tilts, self.most, self._metal(si, active))
        return dr.select(active, mi.UnpolarizedSpectrum(value), 0), dr.select(active, pdf, 0)

    def sample(self, ctx, si, sample1, sample2, active):
        """Follow a ray through a groove met by chance, to where all its ways of coming there are counted.

        Grooves are met by their ground area, since all rims are at one height (Heitz and d'Eon 2014, for one bounce).
        Directions and densities carry no gradient: derivatives are those of the value at a fixed direction.
        """
        active = active & (si.wi.z > 0)
        wi = dr.select(active, si.wi, mi.Vector3f(0, 0, 1))
        wo, k = dr.detach(self.draw(si, wi, sample1, sample2, active))
        active = active & (k <= self.most) & (wo.z > 0)
        value, pdf = self.eval_pdf(ctx, si, wo, active)
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo, bs.pdf, bs.eta = wo, dr.detach(pdf), 1
        bs.sampled_type, bs.sampled_component = mi.UInt32(self.components()[0]), 0
        return bs, dr.select(bs.pdf > 0, value / dr.maximum(bs.pdf, TINY), 0)

    def draw(self, si, wi, sample1, sample2, active) -> tuple[Any, Any]:
        """(direction, number of bounces) of a ray that enters a groove anywhere."""
        distribution = self._distribution(si, active)
        x, y = distribution.sample_azimuth(sample2.y)
        tilts = Tilts.along(distribution, x, y)
        tilt = dr.atan2(*tilts.sample(sample2.x))
        partner = tilt
        if not self.symmetric:
            partner = dr.atan2(*tilts.sample_partner(*more_numbers(sample1, *sample2)))
        groove = Groove(tilt, partner)
        across = wi.x * x + wi.y * y
        psi, length = dr.atan2(across, wi.z), dr.sqrt(dr.square(across) + dr.square(wi.z))
        offset, swap = entrance(groove, psi, sample1)
        groove, psi = groove.swapped(swap), dr.select(swap, -psi, psi)
        x, y = dr.select(swap, -x, x), dr.select(swap, -y, y)
        k = (symmetric_bounces if self.symmetric else bounces)(groove, psi, offset, self.most)
        sin, cos = dr.sincos(exit_angle(groove, psi, k))
        along = wi.y * x - wi.x * y  # across the plane of the kaleidoscope; turns round
        return mi.Vector3f(length * sin * x + along * y, length * sin * y - along * x, length * cos), k

    def _alphas(self, si, active) -> tuple[Any, Any]:
        if not self.axes:
            alpha = dr.sqrt(2 / (self.number("exponent", si, active) + 2))
            return alpha, alpha
        largest = DISTRIBUTIONS[self.distribution].largest
        u, v = (clamp(self.number(name, si, active), SMOOTHEST, largest) for name in self.axes)
        return u, v

    def _distribution(self, si, active) -> Distribution:
        return DISTRIBUTIONS[self.distribution](*self._alphas(si, active))

    def _roughest(self) -> float | None:
        """Largest roughness, of the numbers that Mitsuba shows of a texture; None if it shows none."""
        names = ["exponent"] if self.exponent else self.axes
        shown = [[found.ravel() for _, found in numbers(getattr(self, name), differentiated=True)] for name in names]
        if not all(shown):
            return None
        alphas = np.concatenate([part for parts in shown for part in parts])
        if self.exponent:
            alphas = np.sqrt(2 / (np.maximum(alphas, 0) + 2))
        return float(
            np.clip(alphas.max(), SMOOTHEST, min(type(self).alpha.high, DISTRIBUTIONS[self.distribution].largest))
        )

    def _metal(self, si, active) -> Reflectance | None:
        if self.metal.mirror:
            return None
        eta, k = self.metal.eval(si, active)

        def once(cos):
            return conductor(cos, eta, k)

        return Reflectance(once, fit(once) if self.logarithm is None else self.logarithm)

    def _constant_logarithm(self) -> list | None:
        """ln F's fit if it is the same everywhere, for good: else it takes 7 Fresnel terms a call."""
        parts = [part for part in vars(self.metal).values() if part is not None]
        differentiated = any(dr.grad_enabled(value) for part in parts for _, value in mi.traverse(part).items())
        if not parts or mi.is_spectral or differentiated or any(map(varies, parts)):
            return None
        eta, k = self.metal.eval(dr.zeros(mi.SurfaceInteraction3f), True)
        logarithm = fit(lambda cos: conductor(cos, eta, k))
        dr.make_opaque(logarithm)
        return logarithm
