"""How facets hide each other: Smith's way, separable as the paper has it, or in pairs that are V-cavities."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import drjit as dr
import mitsuba as mi

from ...microfacet import ggx
from ...microfacet.distributions import GGX, Beckmann, Distribution, Gaussian
from ...microfacet.masking import (
    cavity_visible_and_lit,
    cavity_visible_density,
    sample_cavity_visible_normal,
    smith_masking,
    smith_separable,
)


class Facets(Protocol):
    """Masking and shadowing G(i, o, m) = `lit` / (<i.m> <o.m>) times `masking`, and normals that are seen.

    Directions are above the horizon; ``facing`` is a dot product w.m.
    """

    level: ClassVar[float]
    """Least chance of a mirrored sample over F of the surface: level facets are seen from far down, or hidden."""
    horizon: ClassVar[float]
    """Share of the body's samples that are even over the hemisphere, for grazing light on rough facets."""

    def lit(self, facing_i: Any, facing_o: Any, cos_i: Any, cos_o: Any, cos_m: Any) -> Any:
        """<i.m> <o.m>, times what of G depends on the facet."""

    def masking(self, distribution: Distribution, wi: Any, wo: Any) -> Any:
        """What of G does not."""

    def visible_density(self, distribution: Distribution, w: Any, m: Any) -> Any:
        """Density per steradian of `visible_normal`."""

    def visible_normal(self, distribution: Distribution, w: Any, u: Any, v: Any) -> Any:
        """The normal of a facet seen along ``w``, for a number and a pair of numbers in [0, 1)."""


@dataclass
class CavityFacets:
    """Facets m and (-m_x, -m_y, m_z) are a V-cavity (Torrance and Sparrow 1967; Eq. 15)."""

    level: ClassVar = 0.63
    horizon: ClassVar = 0.35

    def lit(self, facing_i: Any, facing_o: Any, cos_i: Any, cos_o: Any, cos_m: Any) -> Any:
        """<i.m> <o.m> G."""
        return cavity_visible_and_lit(facing_i, facing_o, cos_i, cos_o, cos_m)

    def masking(self, distribution: Distribution, wi: Any, wo: Any) -> Any:
        """All depends on the facet."""
        return 1

    def visible_density(self, distribution: Distribution, w: Any, m: Any) -> Any:
        """D <w.m> G1 / cos, but for what the Gaussian's samples are off D."""
        return cavity_visible_density(distribution, w, m)

    def visible_normal(self, distribution: Distribution, w: Any, u: Any, v: Any) -> Any:
        """One of the two facets of a cavity (Heitz and d'Eon 2014)."""
        return sample_cavity_visible_normal(distribution, w, v.x, v.y, u)[0]


@dataclass
class SmithFacets:
    """Facets know nothing of their neighbours: G = G1(i) G1(o), of all that face both (Eqs. 17 to 22)."""

    level: ClassVar = 0.0
    horizon: ClassVar = 0.2

    def lit(self, facing_i: Any, facing_o: Any, cos_i: Any, cos_o: Any, cos_m: Any) -> Any:
        """<i.m> <o.m>."""
        return dr.maximum(facing_i, 0) * dr.maximum(facing_o, 0)

    def masking(self, distribution: Distribution, wi: Any, wo: Any) -> Any:
        """G1(i) G1(o)."""
        return smith_separable(distribution.smith_lambda(wi), distribution.smith_lambda(wo))

    def visible_density(self, distribution: Distribution, w: Any, m: Any) -> Any:
        """D <w.m> G1 / cos; for the Gaussian, that of cavities."""
        if not isinstance(distribution, GGX | Beckmann):
            return cavity_visible_density(distribution, w, m)
        return distribution.density(m) * smith_masking(distribution.smith_lambda(w)) * dr.dot(w, m) / w.z

    def visible_normal(self, distribution: Distribution, w: Any, u: Any, v: Any) -> Any:
        """As known for GGX; Mitsuba's for Beckmann; the Gaussian has none but those of cavities, which are near."""
        if isinstance(distribution, GGX):
            m = ggx.sample_visible_normal(ggx.to_sphere(w, distribution.alpha_u, distribution.alpha_v), v.x, v.y)
            return dr.normalize(type(w)(distribution.alpha_u * m.x, distribution.alpha_v * m.y, m.z))
        if isinstance(distribution, Beckmann):
            alphas = distribution.alpha_u, distribution.alpha_v
            known = mi.MicrofacetDistribution(mi.MicrofacetType.Beckmann, *alphas, True)
            return mi.Vector3f(known.sample(w, v)[0])
        return sample_cavity_visible_normal(distribution, w, v.x, v.y, u)[0]


DISTRIBUTIONS: dict[str, type[Distribution]] = {"beckmann": Beckmann, "ggx": GGX, "gaussian": Gaussian}
"""By the name that a scene uses."""
FACETS: dict[str, type[Facets]] = {"smith": SmithFacets, "vcavity": CavityFacets}
"""By the name that a scene uses for the masking."""
