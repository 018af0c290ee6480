"""The BSDF of interfaced Lambertian microfacets (Meneveaux et al. 2018): parameters, and its two lobes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ...errors import ParameterError
from ...lobes import Lifted, Lobe, LobeModel, diffuse, glossy
from ...microfacet.distributions import GGX, Beckmann, Distribution, Gaussian
from ...microfacet.numerics import clamp
from ...microfacet.sampling import cosine_hemisphere, reflect
from ...microfacet.tables import Made
from ...parameters import Axes, Choice, Colour, Flag, Ior, Usual, constant, numbers, varies
from .body import GRAZING, body_albedo, body_integral, fresnel, interface, outer_reflectance, transmitted
from .facets import FACETS, Facets
from .table import IntegralTable, steps

CITATION = """\
@article{Meneveaux2018Rendering,
  author  = {Meneveaux, Daniel and Bringier, Benjamin and Tauzia, Emmanuelle and Ribardi\\`ere, Micka\\"el and
             Simonot, Lionel},
  title   = {Rendering Rough Opaque Materials with Interfaced Lambertian Microfacets},
  journal = {IEEE Transactions on Visualization and Computer Graphics},
  volume  = {24},
  number  = {3},
  pages   = {1368--1380},
  year    = {2018},
  doi     = {10.1109/TVCG.2017.2660490}
}"""
DISTRIBUTIONS: dict[str, type[Distribution]] = {"beckmann": Beckmann, "ggx": GGX, "gaussian": Gaussian}
"""By the name that a scene uses."""
MATCHED = 1e-3
"""Excess of the outer index that is taken for none: that of air over vacuum is less."""
APART = 1.01
"""Ratio of the indices from which on derivatives by them are those of values nearby."""
RULE, COARSE = (12, 32), (4, 8)
"""Rings and azimuths of the integral over normals, and those of ``approximate``."""


class InterfacedLambertian(LobeModel):
    """Rough dielectric over a diffuse body: ceramic, paint, plastic, chalk.

    Every facet is a smooth interface over a Lambertian body, which light enters and leaves by Fresnel's terms, and in
    which it bounces until it does. With equal indices of refraction there is no interface, and facets are Lambertian
    (rough diffuse, as Oren and Nayar's); with a black body they are mirrors (Cook and Torrance's).
    """

    citation = CITATION

    diffuse_reflectance = Colour("albedo of the body below the interface, K_d", 0.5)
    int_ior = Ior("index of refraction of the body", "bk7")
    ext_ior = Ior("index of refraction outside, at most int_ior", "air")
    distribution = Choice("distribution of the facets' normals", options=tuple(DISTRIBUTIONS))
    masking = Choice("how facets hide each other: independently, or in V-cavities", options=tuple(FACETS))
    alpha = Axes(
        "roughness, never squared; of Gaussian normals their deviation, in radians",
        0.3,
        low=1e-3,
        high=1.5,
        usually=Usual(0.02, 1, logarithmic=True),
    )
    scattering = Choice("how often light meets facets", options=("single",))
    approximate = Flag("whether a coarse rule sums over the facets: as fast, or faster, with errors of 3 %", False)

    def configure(self, given: set[str]) -> None:
        """Complain of what does not go together."""
        self.check()
        self.table = Made()

    def update(self) -> None:
        """Bring the table of the integral up to date, if parameters vary little enough for one."""
        if not self._tabulated():
            self.table = Made()
            return
        make = partial(IntegralTable.made, DISTRIBUTIONS[self.distribution], FACETS[self.masking]())
        n = self._relative_index(constant("int_ior", self.int_ior), constant("ext_ior", self.ext_ior))
        ((name, alpha),) = self.alpha.textures.items()
        if not varies(alpha):
            self.table.update(make, n, self._least(type(self).alpha.clamp(constant(name, alpha))))
            return
        low, high = (float(np.clip(end, type(self).alpha.low, type(self).alpha.high)) for end in self._extent(alpha))
        self.table.update(make, n, *steps(low, high))

    def _tabulated(self) -> bool:
        """Whether the integral depends on few enough numbers."""
        if self.approximate or not self.alpha.isotropic or varies(self.int_ior) or varies(self.ext_ior):
            return False
        (alpha,) = self.alpha.textures.values()
        return not varies(alpha) or bool(self._shown(alpha))

    @staticmethod
    def _shown(texture: Any) -> list[np.ndarray]:
        """The numbers that Mitsuba shows of a texture."""
        return [found for _, found in numbers(texture, differentiated=True)]

    def _extent(self, texture: Any) -> tuple[float, float]:
        shown = self._shown(texture)
        return min(found.min() for found in shown), max(found.max() for found in shown)

    def check(self) -> None:
        """Ranges, the order of the two indices, and where Smith's masking of the Gaussian ends."""
        super().check()
        inner, outer = (self._index(name) for name in ("int_ior", "ext_ior"))
        if inner is not None and outer is not None and inner < outer * (1 - MATCHED):
            raise ParameterError(f"int_ior = {inner:g}: expected at least ext_ior = {outer:g}; the body is denser.")
        if self._ill_posed():
            self._check_smith_of_gaussian()

    def _index(self, name: str) -> float | None:
        """An index of refraction that is the same everywhere."""
        texture = getattr(self, name)
        return None if varies(texture) else max((found.max() for _, found in numbers(texture, True)), default=None)

    def _ill_posed(self) -> bool:
        """Whether facets are steep enough to be infinitely many."""
        return self.distribution == "gaussian" and self.masking == "smith"

    def _check_smith_of_gaussian(self) -> None:
        instead = 'use masking = "vcavity"'
        if not self.alpha.isotropic:
            raise ParameterError(f'alpha_u, alpha_v: masking = "smith" of "gaussian" needs one alpha; {instead}.')
        for name, texture in self.alpha.textures.items():
            high = max((shown.max() for _, shown in numbers(texture)), default=0)
            if high > Gaussian.largest_smith:
                raise ParameterError(
                    f'{name} = {high:g}: masking = "smith" of "gaussian" ends at {Gaussian.largest_smith}; {instead}.'
                )

    def ranges(self) -> dict[str, tuple[float, float]]:
        """Either index ends near the other; a Gaussian with Smith's masking where that ends.

        When indices part, the interface appears on grazing facets first: where they are equal, no derivative sees it.
        """
        found, inner, outer = super().ranges(), self._index("int_ior"), self._index("ext_ior")
        if outer is not None:
            found["int_ior"] = max(outer * APART, found["int_ior"][0]), found["int_ior"][1]
        if inner is not None:
            found["ext_ior"] = found["ext_ior"][0], min(inner / APART, found["ext_ior"][1])
        if self._ill_posed():
            found["alpha"] = found["alpha"][0], Gaussian.largest_smith
        return found

    def flags(self) -> list[int]:
        """A glossy lobe, and a diffuse one."""
        return [glossy(self.alpha.isotropic), diffuse(self.alpha.isotropic)]

    def lobes(self, si: Any, active: Any) -> list[Lobe]:
        """Light that facets mirror, and light from below them."""
        n = self._relative_index(self.at("int_ior", si, active), self.at("ext_ior", si, active))
        alphas = [self._least(alpha) for alpha in self.at("alpha", si, active)]
        distribution, facets = DISTRIBUTIONS[self.distribution](*alphas), FACETS[self.masking]()
        scale = body_albedo(self.at("diffuse_reflectance", si, active), n)

        def integral(wi: Any, wo: Any) -> Any:
            if self.table.result is not None:
                return self.table.result.at(alphas[0], wi, wo)
            return body_integral(distribution, facets, n, wi, wo, *(COARSE if self.approximate else RULE))

        lobes: list[Lobe] = [Interface(distribution, facets, n), Body(distribution, n, scale, integral)]
        return [Lifted(lobe, lift) for lobe in lobes]

    def _relative_index(self, inner: Any, outer: Any) -> Any:
        return clamp(inner / outer, 1, 10)

    def _least(self, alpha: Any) -> Any:
        """The roughness, or where Smith's masking of the Gaussian ends."""
        return dr.minimum(alpha, Gaussian.largest_smith) if self._ill_posed() else alpha


def lift(w: Any) -> Any:
    """``w``, raised to a cosine of `GRAZING` at least."""
    return type(w)(w.x, w.y, dr.maximum(w.z, GRAZING))


def typical_cosine(distribution: Distribution, w: Any) -> Any:
    """Cosine at which facets are met along ``w``, roughly: rough ones face it more than the surface does."""
    tilt = dr.sqrt(dr.square(distribution.alpha_u * w.x) + dr.square(distribution.alpha_v * w.y) + 1e-14)
    return dr.minimum(w.z + tilt, 1)


@dataclass
class Interface(Lobe):
    """The lobe of the interfaces (Eq. 4), drawn by visible normals."""

    distribution: Distribution
    facets: Facets
    n: Any

    def share(self, wi: Any) -> Any:
        """F at a typical facet."""
        return fresnel(typical_cosine(self.distribution, wi), self.n)

    def eval_pdf(self, wi: Any, wo: Any) -> tuple[Any, Any]:
        """F D G / (4 cos_i), and the density of visible normals over 4 i.m."""
        m = dr.normalize(wi + wo)
        density = self.facets.visible_density(self.distribution, wi, m) / (4 * dr.dot(wi, m))
        return interface(self.distribution, self.facets, self.n, wi, wo), density

    def draw(self, wi: Any, u: Any, v: Any) -> Any:
        """Mirrored in a visible normal."""
        return reflect(wi, self.facets.visible_normal(self.distribution, wi, u, v))


@dataclass
class Body(Lobe):
    """The lobe of the bodies below the interfaces (Eq. 13), drawn by cosine."""

    distribution: Distribution
    n: Any
    scale: Any  # Q, a spectrum
    integral: Callable[[Any, Any], Any]  # (wi, wo) -> I

    def share(self, wi: Any) -> Any:
        """What a typical facet lets in, and out again."""
        inside = transmitted(typical_cosine(self.distribution, wi), self.n)
        return inside * (1 - outer_reflectance(self.n)) * dr.mean(mi.UnpolarizedSpectrum(self.scale))

    def eval_pdf(self, wi: Any, wo: Any) -> tuple[Any, Any]:
        """Q I cos_o / pi, and the cosine over pi."""
        cosine = wo.z / dr.pi
        return self.scale * (self.integral(wi, wo) * cosine), cosine

    def draw(self, wi: Any, u: Any, v: Any) -> Any:
        """By cosine."""
        return cosine_hemisphere(v.x, v.y)
