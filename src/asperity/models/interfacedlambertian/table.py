"""Functions of two directions as tables, for facets that are alike around the normal and have one index of refraction.

Such a function depends on two cosines and the azimuth phi between them, and on the roughness. It is, or its root is, a
polynomial in t = 2 cos(phi / 2) - 1, smooth at both ends, whose coefficients are linear between nodes: of either
direction evenly in

    x = log(1 + v / k) / log(1 + 1 / k),    v = 1 - tan(theta / 2),    k of the size of the roughness,

which are dense towards the horizon, where light varies over angles as large as the facets' tilts. What of a table grows
as 1 / cos there is 1 + horizon alpha / (cos_i + cos_o) times what is stored.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import drjit as dr
import numpy as np

from ...microfacet.ggx import inclination
from ...microfacet.tables import Table, array_types
from .body import GRAZING

COSINES = 32
"""Nodes of either direction."""
RATIO, LEVELS = 1.25, 24
"""Largest ratio of two roughnesses that follow each other, as long as there are no more than these."""
SMOOTHEST = 3e-3
"""Least k."""
SMALLEST = 1e-12
"""What roots are taken of, so that they have derivatives."""


class Build(NamedTuple):
    """How a table is made, and how large it is."""

    terms: int  # of the polynomial in t; a power of two
    azimuths: int  # at which it is fitted
    rule: tuple[int, int]  # of sums over normals: rings and azimuths
    near: float  # k over the roughness
    horizon: float = 0


@dataclass
class PairTable:
    """A function of two directions, either order of which has the same value, for any roughness between two."""

    table: Table  # coefficients over the logarithm of the roughness and the x of either direction
    low: float  # least roughness, and the logarithm of the largest over it
    extent: float
    build: Build
    rooted: bool  # whether the polynomial is the root

    def native(self) -> PairTable:
        """The same for the active variant."""
        return replace(self, table=self.table.native())

    def at(self, alpha: Any, wi: Any, wo: Any) -> Any:
        """Its value."""
        if self.table.shape[0] == 1:
            alpha = dr.detach(alpha)  # the table knows, whose nodes keep their places
        (sin_i, cos_i), (sin_o, cos_o) = inclination(wi), inclination(wo)
        cos_phi = (wi.x * wo.x + wi.y * wo.y) / dr.maximum(sin_i * sin_o, 1e-8)
        t = dr.minimum(2 * dr.sqrt(dr.maximum((1 + cos_phi) / 2, 1e-12)) - 1, 1)
        k = nearness(self.build.near, alpha)
        most = dr.rcp(dr.log(1 + dr.rcp(k)))
        x_i, x_o = (dr.log(1 + (1 - sin / (1 + cos)) / k) * most for sin, cos in ((sin_i, cos_i), (sin_o, cos_o)))
        value = chebyshev(self.table.at(dr.log(alpha / self.low) / self.extent, x_i, x_o, triangles=True), t)
        return growth(self.build, alpha, wi, wo) * (dr.square(value) if self.rooted else dr.maximum(value, 0))


def nearness(near: float, alpha: Any) -> Any:
    """k, but for facets so smooth that nodes for them would be missed elsewhere."""
    return dr.maximum(near * alpha, SMOOTHEST)


def growth(build: Build, alpha: Any, wi: Any, wo: Any) -> Any:
    """How fast values grow towards the horizon."""
    return 1 + build.horizon * alpha / (wi.z + wo.z) if build.horizon else 1


def steps(low: float, high: float) -> tuple[float, float]:
    """(low, high), moved outwards to powers of `RATIO`: few changes of a texture then ask for another table."""
    step = math.log(RATIO)
    below, above = math.floor(math.log(low) / step + 1e-6), math.ceil(math.log(high) / step - 1e-6)
    return RATIO**below, RATIO ** max(above, below + 1)


def chebyshev(coefficients: Any, t: Any) -> Any:
    """The sum of Chebyshev's polynomials of ``t`` in [-1, 1], by Clenshaw's recurrence."""
    last, before = 0, 0
    for coefficient in reversed(coefficients[1:]):
        last, before = coefficient + 2 * t * last - before, last
    return coefficients[0] + t * last - before


def tabulate(
    f: Callable[..., tuple], rooted: tuple[bool, ...], build: Build, low: Any, *high: float
) -> list[PairTable]:
    """Tables of what ``f(alpha, wi, wo, rings, azimuths)`` returns as a tuple, as roots or not, for one roughness.

    Or for all between two, which are plain numbers then. What carries derivatives passes them on.
    """
    Float, _ = array_types("alpha")
    alpha, least, extent = Float(low), 1.0, 1.0
    if high:
        least, extent = low, math.log(high[0] / low)
        levels = min(LEVELS, 1 + math.ceil(extent / math.log(RATIO) - 1e-6))
        alpha = Float((low * np.exp(np.linspace(0, extent, levels))).astype(np.float32))
    shape = dr.width(alpha), COSINES, COSINES
    nodes = Nodes.of(build, alpha)
    share = dr.rcp(growth(build, dr.detach(nodes.arguments[0]), *nodes.arguments[1:]))
    values = [share * value for value in f(*nodes.arguments, *build.rule)]
    roots = [dr.sqrt(dr.maximum(value, SMALLEST)) if root else value for value, root in zip(values, rooted)]
    entries = [nodes.entries(root) for root in roots]
    dr.eval(entries)
    tables = [Table(one, shape, build.terms) for one in entries]
    return [PairTable(table, least, extent, build, root) for table, root in zip(tables, rooted)]


@dataclass
class Nodes:
    """Each roughness with each pair of directions, in one order, at each azimuth between them, innermost."""

    build: Build
    arguments: tuple[Any, Any, Any]  # roughness, wi, wo

    @classmethod
    def of(cls, build: Build, alpha: Any) -> Nodes:
        """Those of these roughnesses, an array."""
        Float, (_, Vector) = type(alpha), array_types("alpha")
        UInt = dr.uint32_array_t(Float)
        first, second = np.triu_indices(COSINES)
        shape = dr.width(alpha), first.size, build.azimuths
        level, pair, azimuth = (UInt(index.ravel().astype(np.uint32)) for index in np.indices(shape))
        phi = cls.phi(build)
        sin_phi, cos_phi = (dr.gather(Float, Float(f(phi).astype(np.float32)), azimuth) for f in (np.sin, np.cos))
        alpha = dr.gather(Float, alpha, level)
        k = nearness(build.near, dr.detach(alpha))

        def direction(which: np.ndarray) -> tuple[Any, Any]:
            """(sine, cosine) of the first or second of a pair."""
            x = Float(dr.gather(UInt, UInt(which.astype(np.uint32)), pair)) / (COSINES - 1)
            tangent = dr.clip(1 - k * (dr.exp(x * dr.log(1 + dr.rcp(k))) - 1), 0, 1 - GRAZING)
            square = dr.square(tangent)
            return 2 * tangent / (1 + square), (1 - square) / (1 + square)

        (sin_i, cos_i), (sin_o, cos_o) = direction(first), direction(second)
        return cls(build, (alpha, Vector(sin_i, 0, cos_i), Vector(sin_o * cos_phi, sin_o * sin_phi, cos_o)))

    @staticmethod
    def phi(build: Build) -> np.ndarray:
        """The azimuths, in (0, pi): Chebyshev's nodes of t."""
        return 2 * np.arccos((1 + np.cos((np.arange(build.azimuths) + 0.5) * math.pi / build.azimuths)) / 2)

    def entries(self, values: Any) -> Any:
        """Coefficients, innermost, of each roughness and pair of directions in either order: least squares."""
        terms, azimuths = self.build.terms, self.build.azimuths
        Float, pairs = type(values), COSINES * (COSINES + 1) // 2
        UInt, levels = dr.uint32_array_t(Float), dr.width(values) // (pairs * azimuths)
        fit = np.linalg.pinv(np.polynomial.chebyshev.chebvander(2 * np.cos(self.phi(self.build) / 2) - 1, terms - 1))
        shape = levels * pairs, terms, azimuths
        node, term, azimuth = (UInt(index.ravel().astype(np.uint32)) for index in np.indices(shape))
        weight = dr.gather(Float, Float(fit.ravel().astype(np.float32)), term * azimuths + azimuth)
        found = dr.block_sum(weight * dr.gather(Float, values, node * azimuths + azimuth), azimuths)
        first, second = np.triu_indices(COSINES)
        pair = np.zeros((COSINES, COSINES), dtype=np.uint32)
        pair[first, second] = pair[second, first] = np.arange(pairs)
        row = np.arange(levels)[:, None, None] * pairs + pair
        entry = row[..., None] * terms + np.arange(terms)
        return dr.gather(Float, found, UInt(entry.ravel().astype(np.uint32)))
