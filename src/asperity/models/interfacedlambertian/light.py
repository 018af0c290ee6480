"""Light from the bodies below the facets, by how often it meets facets: looked up, or summed for every call."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import drjit as dr

from ...microfacet.distributions import Distribution
from ...microfacet.tables import array_types
from .body import body_albedo, body_integral
from .facets import CavityFacets, Facets, SmithFacets
from .interreflection import EvenTransmittance, two_bounces
from .remainder import More
from .table import Build, PairTable, tabulate

BUILDS = {
    (SmithFacets, False): Build(8, 12, (16, 12), 0.3),
    (SmithFacets, True): Build(8, 12, (16, 12), 0.3),
    (CavityFacets, False): Build(16, 24, (16, 12), 0.1, 0.01),
    (CavityFacets, True): Build(8, 12, (16, 12), 0.1, 0.01),
}
"""Of I by the masking, and whether for many roughnesses: those cost time and memory. Cavities have kinks."""
TWICE = Build(8, 12, (16, 10), 0.1)
"""Of two bounces, which are less light: .2 % of what bodies scatter at the 95th percentile, .3 % at the 99th."""


@dataclass
class Known:
    """What is made from constants; None where it is summed for every call, or not wanted."""

    once: PairTable | None = None  # I, of one bounce
    mixed: PairTable | None = None  # c_1 and c_2, of two
    twice: PairTable | None = None
    tau: EvenTransmittance | None = None
    more: More | None = None

    @classmethod
    def made(
        cls,
        kind: type[Distribution],
        facets: Facets,
        scattering: str,
        tabulated: bool,
        rule: tuple[int, int],
        n: Any,
        *alphas: Any,
    ) -> Known:
        """For the index ``n``; tables for one roughness, or between two; ``multiple`` of one, or along x and y."""
        Float, Vector = array_types("alpha")
        known, n = cls(), Float(n)
        if scattering != "single":
            known.tau = tau = EvenTransmittance.made(n)

        def once(alpha: Any, wi: Any, wo: Any, *rule: int) -> tuple[Any]:
            return (body_integral(kind(alpha, alpha), facets, n, wi, wo, *rule),)

        def twice(alpha: Any, wi: Any, wo: Any, *rule: int) -> tuple[Any, Any]:
            return two_bounces(kind(alpha, alpha), n, tau, wi, wo, *rule)

        if tabulated:
            (known.once,) = tabulate(once, (True,), BUILDS[type(facets), len(alphas) > 1], *alphas)
            if known.tau is not None:
                known.mixed, known.twice = tabulate(twice, (True, False), TWICE, *alphas)
        if scattering == "multiple":
            distribution, white = kind(Float(alphas[0]), Float(alphas[-1])), body_albedo(1, n)
            light = Light(distribution, facets, n, rule, known)
            known.more = More.made(distribution, n, lambda wi, wo: light(wi, wo, white), Vector, len(alphas) == 1)
        return known.native()

    def native(self) -> Known:
        """The same for the active variant."""
        return replace(self, **{name: part.native() for name, part in vars(self).items() if part is not None})


@dataclass
class Light:
    """f of the light from the bodies, at a surface point."""

    distribution: Distribution
    facets: Facets
    n: Any
    rule: tuple[int, int]  # of sums over normals
    known: Known

    def __call__(self, wi: Any, wo: Any, scale: Any) -> Any:
        """f per steradian, for the ``scale`` Q, a spectrum or number."""
        once, known = self._once(wi, wo), self.known
        value = scale * (once / dr.pi)
        if known.tau is None:
            return value
        mixed, twice = self._twice(known.tau, wi, wo)
        value = value + scale * mixed + scale * scale * twice
        if known.more is None:
            return value
        shade = scale / body_albedo(1, self.n)
        if dr.depth_v(shade) > dr.depth_v(wi.z):
            return value + type(shade)([known.more(wi, wo, channel) for channel in shade])
        return value + known.more(wi, wo, shade)

    def _once(self, wi: Any, wo: Any) -> Any:
        if self.known.once is not None:
            return self.known.once.at(self.distribution.alpha_u, wi, wo)
        return body_integral(self.distribution, self.facets, self.n, wi, wo, *self.rule)

    def _twice(self, tau: EvenTransmittance, wi: Any, wo: Any) -> tuple[Any, Any]:
        if self.known.mixed is not None and self.known.twice is not None:
            alpha = self.distribution.alpha_u
            return self.known.mixed.at(alpha, wi, wo), self.known.twice.at(alpha, wi, wo)
        return two_bounces(self.distribution, self.n, tau, wi, wo, *self.rule)
