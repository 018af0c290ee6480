"""The BSDF of interfaced Lambertian microfacets (Meneveaux et al. 2018): parameters, and its two lobes."""

from __future__ import annotations

from functools import partial
from typing import Any

import drjit as dr
import numpy as np

from ...errors import ParameterError
from ...lobes import Lifted, Lobe, LobeModel, diffuse, glossy
from ...microfacet.distributions import Gaussian
from ...microfacet.numerics import clamp
from ...microfacet.tables import Made
from ...parameters import Axes, Choice, Colour, Flag, Ior, Usual, all_shown, constant, numbers, varies
from .body import body_albedo
from .facets import DISTRIBUTIONS, FACETS
from .interreflection import CavityMirrors
from .light import Known, Light
from .lobes import Body, Interface, lift, mirrored_share
from .microgeometry import ExplicitCavities
from .table import steps

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
MATCHED = 1e-3
"""Excess of the outer index that is taken for none: that of air over vacuum is less."""
APART = 1.01
"""Ratio of the indices from which on derivatives by them are those of values nearby."""
RULE, COARSE = (16, 12), (4, 8)
"""Rings and azimuths of the integral over normals, and those of ``approximate``."""


class InterfacedLambertian(LobeModel):
    """Rough dielectric over a diffuse body: ceramic, paint, plastic, chalk.

    Every facet is a smooth interface over a Lambertian body, which light enters and leaves by Fresnel's terms, and in
    which it bounces until it does. With equal indices of refraction there is no interface, and facets are Lambertian
    (rough diffuse, as Oren and Nayar's); with a black body they are mirrors (Cook and Torrance's).
    """

    citation = CITATION
    geometry = ExplicitCavities

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
    scattering = Choice(
        "how often light meets facets at most: once, twice, or as often as it takes, in V-cavities",
        options=("single", "double", "multiple"),
    )
    approximate = Flag("whether a coarse rule sums over the facets, with errors of 3 %, instead of a table", False)

    def configure(self, given: set[str]) -> None:
        """Settle the masking, and complain of what does not go together."""
        if self.scattering != "single":
            if "masking" in given and self.masking != "vcavity":
                how = f'masking = {self.masking!r}: scattering = "{self.scattering}" is in V-cavities'
                raise ParameterError(f'{how}; use masking = "vcavity", or leave it out.')
            self.masking = "vcavity"
        self.check()
        self.known = Made()

    def update(self) -> None:
        """Bring up to date what is made from the parameters that do not vary over the surface."""
        tabulated, constants = self._constants()
        if not (tabulated or constants):
            self.known = Made(Known())
            return
        kind, facets = DISTRIBUTIONS[self.distribution], FACETS[self.masking]()
        self.known.update(partial(Known.made, kind, facets, self.scattering, tabulated, self.rule), *constants)

    @property
    def rule(self) -> tuple[int, int]:
        """Rings and azimuths of sums for every call."""
        return COARSE if self.approximate else RULE

    def _constants(self) -> tuple[bool, list[Any]]:
        """(whether tables are made, from what: the relative index, and the roughness or both ends of it).

        Without tables, the roughness is that along x and y, if many bounces need it.
        """
        single, textures = self.scattering == "single", list(self.alpha.textures.items())
        if single and (varies(self.int_ior) or varies(self.ext_ior)):
            return False, []
        why = f' by scattering = "{self.scattering}"'
        n = self._relative_index(constant("int_ior", self.int_ior, why), constant("ext_ior", self.ext_ior, why))
        if self.scattering == "multiple" or not any(varies(texture) for _, texture in textures):
            alphas = [self._least(type(self).alpha.clamp(constant(name, texture, why))) for name, texture in textures]
            tabulated = self.alpha.isotropic and not self.approximate
            needed = tabulated or self.scattering == "multiple"
            return tabulated, [n, *alphas] if needed else [] if single else [n]
        if self.approximate or not (self.alpha.isotropic and all_shown(textures[0][1])):
            return False, [] if single else [n]
        shown = [found.ravel() for _, found in numbers(textures[0][1], differentiated=True)]
        ends = np.clip([min(map(np.min, shown)), max(map(np.max, shown))], type(self).alpha.low, type(self).alpha.high)
        return True, [n, *steps(*map(float, ends))]

    def check(self) -> None:
        """Ranges, the order of the two indices, and where Smith's masking of the Gaussian ends."""
        super().check()
        inner, outer = self._indices("int_ior"), self._indices("ext_ior")
        if inner and outer:
            # Two textures may go together: they are wrong for sure if they are everywhere.
            both = varies(self.int_ior) and varies(self.ext_ior)
            least, most = (inner[1], outer[0]) if both else (inner[0], outer[1])
            if least < most * (1 - MATCHED):
                raise ParameterError(f"int_ior = {least:g}: expected at least ext_ior = {most:g}; the body is denser.")
        if self._ill_posed():
            self._check_smith_of_gaussian()

    def _indices(self, name: str) -> list[float]:
        """The ends of an index of refraction, as far as its texture shows them."""
        shown = [found for _, found in numbers(getattr(self, name), True)]
        return [float(f(list(map(f, shown)))) for f in (np.min, np.max)] if shown else []

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
        found, inner, outer = super().ranges(), self._indices("int_ior"), self._indices("ext_ior")
        if outer:
            found["int_ior"] = max(outer[1] * APART, found["int_ior"][0]), found["int_ior"][1]
        if inner:
            found["ext_ior"] = found["ext_ior"][0], min(inner[0] / APART, found["ext_ior"][1])
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

        light = Light(distribution, facets, n, self.rule, self.known.result)
        interface: Lobe = Interface(distribution, facets, n)
        if self.scattering != "single":
            interface = CavityMirrors(distribution, n, partial(mirrored_share, distribution, facets, n))
        return [Lifted(lobe, lift) for lobe in (interface, Body(distribution, facets, n, scale, light))]

    def _relative_index(self, inner: Any, outer: Any) -> Any:
        return clamp(inner / outer, 1, 10)

    def _least(self, alpha: Any) -> Any:
        """The roughness, or where Smith's masking of the Gaussian ends."""
        return dr.minimum(alpha, Gaussian.largest_smith) if self._ill_posed() else alpha
