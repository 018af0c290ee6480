"""The integral over facets as a table, where facets are alike around the normal and have one index of refraction.

I(i, o) then depends on two cosines and the azimuth phi between them, and on the roughness. Its root is a polynomial in
t = 2 cos(phi / 2) - 1, smooth at both ends, whose coefficients are linear between nodes: of either direction evenly in

    x = log(1 + v / k) / log(1 + 1 / k),    v = 1 - tan(theta / 2),    k of the size of the roughness,

which are dense towards the horizon, where I varies over angles as large as the facets' tilts.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr
import numpy as np

from ...microfacet.distributions import Distribution
from ...microfacet.ggx import inclination
from ...microfacet.tables import Table, array_types
from .body import GRAZING, body_integral
from .facets import CavityFacets, Facets, SmithFacets

COSINES = 32
"""Nodes of either direction."""
RATIO, LEVELS = 1.25, 24
"""Largest ratio of two roughnesses that follow each other, as long as there are no more than these."""
SMOOTHEST = 3e-3
"""Least k."""
SMALLEST = 1e-12
"""Of I, so that its root has derivatives."""


class Build(NamedTuple):
    """How a table is made, and how large it is."""

    terms: int  # of the polynomial in t; a power of two
    azimuths: int  # at which it is fitted
    rule: tuple[int, int]  # of the sum over normals, rings and azimuths
    near: float  # k over the roughness


BUILDS = {
    (SmithFacets, False): Build(8, 24, (32, 64), 0.3),
    (SmithFacets, True): Build(8, 12, (16, 48), 0.3),
    (CavityFacets, False): Build(16, 48, (32, 64), 0.1),
    (CavityFacets, True): Build(8, 24, (32, 64), 0.1),
}
"""By the masking, and whether for many roughnesses: those cost time and memory. Cavities have kinks."""


@dataclass
class IntegralTable:
    """`body_integral` of one index of refraction, for any roughness between two."""

    table: Table  # coefficients of the root of I, over the logarithm of the roughness and the x of either direction
    low: float  # least roughness, and the logarithm of the largest over it
    octaves: float
    near: float

    @classmethod
    def made(cls, kind: type[Distribution], facets: Facets, n: Any, alpha: Any, high: float | None = None) -> Any:
        """The table for the index ``n`` and the roughness ``alpha``, or from that to ``high``, which are plain numbers.

        If n or alpha carry derivatives, so does the table.
        """
        build = BUILDS[type(facets), high is not None]
        low, octaves, levels = 1.0, 1.0, 1
        if high is not None:
            low, octaves = alpha, math.log(high / alpha)
            levels = min(LEVELS, 1 + math.ceil(octaves / math.log(RATIO) - 1e-6))
            alpha = low * np.exp(np.linspace(0, octaves, levels))
        Float, Vector = array_types("alpha")
        n = Float(n)

        def root(alpha: Any, wi: Any, wo: Any) -> tuple:
            return (dr.sqrt(dr.maximum(body_integral(kind(alpha, alpha), facets, n, wi, wo, *build.rule), SMALLEST)),)

        (table,) = coefficients(build, root, Float(alpha), Vector)
        return cls(Table(table, (levels, COSINES, COSINES), build.terms).native(), low, octaves, build.near)

    def at(self, alpha: Any, wi: Any, wo: Any) -> Any:
        """I(i, o)."""
        if self.table.shape[0] == 1:
            alpha = dr.detach(alpha)  # the table knows, whose nodes keep their places
        x_i, x_o, t = coordinates(nearness(self.near, alpha), wi, wo)
        level = dr.log(alpha / self.low) / self.octaves
        return dr.square(chebyshev(self.table.at(level, x_i, x_o), t))


def coordinates(k: Any, wi: Any, wo: Any) -> tuple[Any, Any, Any]:
    """(x of wi, x of wo, t)."""
    (sin_i, cos_i), (sin_o, cos_o) = inclination(wi), inclination(wo)
    cos_phi = (wi.x * wo.x + wi.y * wo.y) / dr.maximum(sin_i * sin_o, 1e-8)
    most = dr.rcp(dr.log(1 + dr.rcp(k)))
    x_i, x_o = (dr.log(1 + (1 - sin / (1 + cos)) / k) * most for sin, cos in ((sin_i, cos_i), (sin_o, cos_o)))
    return x_i, x_o, dr.minimum(2 * dr.sqrt(dr.maximum((1 + cos_phi) / 2, 1e-12)) - 1, 1)


def steps(low: float, high: float) -> tuple[float, float]:
    """(low, high), moved outwards to powers of `RATIO`: few changes of a texture then ask for another table."""
    step = math.log(RATIO)
    below, above = math.floor(math.log(low) / step + 1e-6), math.ceil(math.log(high) / step - 1e-6)
    return RATIO**below, RATIO ** max(above, below + 1)


def nearness(near: float, alpha: Any) -> Any:
    """k, but for facets so smooth that nodes for them would be missed elsewhere."""
    return dr.maximum(near * alpha, SMOOTHEST)


def chebyshev(coefficients: Any, t: Any) -> Any:
    """The sum of Chebyshev's polynomials of ``t`` in [-1, 1], by Clenshaw's recurrence."""
    last, before = 0, 0
    for coefficient in reversed(coefficients[1:]):
        last, before = coefficient + 2 * t * last - before, last
    return coefficients[0] + t * last - before


def coefficients(build: Build, values: Callable[[Any, Any, Any], tuple], alpha: Any, Vector: Any) -> list[Any]:
    """Coefficients of each roughness and pair of directions, innermost, by least squares at a few azimuths.

    They are those of each of ``values(alpha, wi, wo)``. Of either order of a pair they are the same, and so found for
    one.
    """
    Float, levels = type(alpha), dr.width(alpha)
    UInt = dr.uint32_array_t(Float)
    first, second = np.triu_indices(COSINES)
    pair = np.zeros((COSINES, COSINES), dtype=np.uint32)
    pair[first, second] = pair[second, first] = np.arange(first.size)
    shape = levels, first.size, build.azimuths
    level, number, azimuth = (UInt(index.ravel().astype(np.uint32)) for index in np.indices(shape))
    phi = (np.arange(build.azimuths) + 0.5) * math.pi / build.azimuths
    sin_phi, cos_phi = (dr.gather(Float, Float(f(phi)), azimuth) for f in (np.sin, np.cos))
    alpha = dr.gather(Float, alpha, level)
    k = nearness(build.near, dr.detach(alpha))

    def node(which: Any) -> tuple[Any, Any]:
        """(sine, cosine) of a pair's first or second direction."""
        x = Float(dr.gather(UInt, UInt(which.astype(np.uint32)), number)) / (COSINES - 1)
        tangent = dr.clip(1 - k * (dr.exp(x * dr.log(1 + dr.rcp(k))) - 1), 0, 1 - GRAZING)
        return 2 * tangent / (1 + dr.square(tangent)), (1 - dr.square(tangent)) / (1 + dr.square(tangent))

    (sin_i, cos_i), (sin_o, cos_o) = node(first), node(second)
    wi, wo = Vector(sin_i, 0, cos_i), Vector(sin_o * cos_phi, sin_o * sin_phi, cos_o)
    functions = values(alpha, wi, wo)
    dr.eval(functions)
    fit = np.linalg.pinv(np.polynomial.chebyshev.chebvander(2 * np.cos(phi / 2) - 1, build.terms - 1))
    shape = levels * first.size, build.terms, build.azimuths
    number, term, azimuth = (UInt(index.ravel().astype(np.uint32)) for index in np.indices(shape))
    weight = dr.gather(Float, Float(fit.ravel()), term * build.azimuths + azimuth)
    entry = (np.arange(levels)[:, None, None, None] * first.size + pair[..., None]) * build.terms
    entry = UInt((entry + np.arange(build.terms)).ravel().astype(np.uint32))
    entries = []
    for function in functions:
        found = dr.block_sum(weight * dr.gather(Float, function, number * build.azimuths + azimuth), build.azimuths)
        entries.append(dr.gather(Float, found, entry))
    dr.eval(entries)
    return entries
