"""Grooves of independent tilts whose roughness and metal are the same everywhere: two bounces and more, by tables.

For one roughness alike around the normal, f sin theta depends on theta and delta of the `Pair`, if facets are mirrors;
of metal on l, too, by a factor that is smooth. So, with the sum over k >= 2 of `nonsymmetric`,

    f = T(theta, delta) R(theta, delta, l) / (4 l^2 sin theta),    T = sum / (C cos x cos y cos delta),

where cos x cos y = cos_i cos_o / l^2. T stays finite at all edges: at the horizon, where x = theta + delta is pi/2 and
the light from there meets only the rims, f is 0 / 0 otherwise. Values vary over angles as large as the roughness near
theta = 0 and at the horizon, so that nodes are denser there, and by powers of ten: stored are fourth roots, between
which a line is close to an exponential.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ...microfacet.distributions import Distribution
from ...microfacet.fast import greater, lesser, reciprocals
from ...microfacet.tables import Table, array_types, native
from .fresnel import Reflectance
from .kaleidoscope import Pair
from .nonsymmetric import several, single_bounce
from .symmetric import POLE
from .tilts import TILTS, Tilts

HALF = np.pi / 2
ANGLES = 128, 128
"""Nodes of T, over theta and delta."""
COLOURS = 40, 64, 24
"""Nodes of R, over theta, delta and the root of l."""
FINE, COARSE = (12, 24), (6, 12)
"""Nodes of the quadrature for T and, as a quotient of two sums, for R: more than each ray can afford."""
ROUGHEST = 1.5
"""Beyond this roughness steep grooves are so many that the table has errors of several per cent: at it 1.3 %."""
EDGE, INSIDE = 0.02, 1e-5
"""How far inside, in cells and in radians, the last nodes are computed: at the edges themselves all is 0 / 0."""


@dataclass
class Layout:
    """Where the nodes are, for a roughness alpha.

    Both coordinates are in [0, 1]: that of theta is dense at both ends, that of delta at the horizon. Each is the angle
    over its largest value, times a mean, with these weights, of 1 and of hyperbolas over ``alpha``.
    """

    alpha: Any

    def coordinates(self, theta: Any, delta: Any) -> tuple[Any, Any]:
        """Those of theta and delta."""
        room = greater(HALF - theta, 1e-6)  # for delta
        above = greater(room - delta, 0)  # the horizon
        near, far, edge, inverse = reciprocals(theta + self.alpha / 2, room + self.alpha, above + self.alpha, room)
        return self._of_theta(theta, near, far), delta * inverse * (0.7 + 0.3 * self.alpha * edge)

    def _of_theta(self, theta: Any, near: Any, far: Any) -> Any:
        return theta / HALF * (0.3 + 0.4 * (HALF + self.alpha / 2) * near + 0.3 * self.alpha * far)

    def theta(self, x: np.ndarray) -> np.ndarray:
        """The angles with these coordinates, for a roughness that is a number: by bisection."""
        low, high = np.zeros_like(x), np.full_like(x, HALF)
        for _ in range(50):
            middle = (low + high) / 2
            below = self._of_theta(middle, 1 / (middle + self.alpha / 2), 1 / (HALF - middle + self.alpha)) < x
            low, high = np.where(below, middle, low), np.where(below, high, middle)
        return high

    def delta(self, y: Any, theta: Any) -> Any:
        """The angle with this coordinate: the smaller root of .7 delta^2 - b delta + c."""
        room = HALF - theta
        b, c = 0.7 * room + self.alpha + y * room, y * room * (room + self.alpha)
        return 2 * c / (b + dr.sqrt(greater(b * b - 2.8 * c, 0)))


@dataclass
class Tabulated:
    """`nonsymmetric` for one roughness, and one metal or mirrors."""

    layout: Layout
    mirrors: Table  # the fourth root of T
    metal: Table | None  # the fourth root of R

    @classmethod
    def of(cls, distribution: type[Distribution], alpha: float, most: int, logarithm: list | None) -> Tabulated:
        """For at most so many bounces, and what is None or the ``logarithm`` of a `Reflectance`."""
        Float, Vector = array_types("symmetric")
        UInt = dr.uint32_array_t(Float)
        tilts, bounces = TILTS[distribution](dr.opaque(Float, alpha)), dr.opaque(UInt, most)
        layout = Layout(tilts.alpha)
        pair = _pairs(layout, alpha, ANGLES)
        total = several(pair, tilts, bounces, None, FINE)[1] / (_horizons(pair) * pair.cos_delta * tilts.partner())
        mirrors, metal = Table.of(ANGLES, [_fourth_root(total)]), None
        if logarithm is not None:
            pair = _pairs(layout, alpha, COLOURS)
            if not dr.is_jit_v(mi.Float):  # plain numbers
                spectrum = Vector if dr.size_v(logarithm[0]) == 3 else Float
                logarithm = [spectrum(*coefficient) for coefficient in logarithm]
            reflectance = Reflectance(lambda cos: 1, logarithm)
            colour, total = several(pair, tilts, bounces, reflectance, COARSE, each=True)
            channels = [_fourth_root(channel / greater(total, 1e-30)) for channel in colour]
            dr.eval(channels)
            channels = [_straddled(channel, COLOURS[-1]) for channel in channels]
            metal = Table.of(COLOURS, channels + channels[:1] * (len(channels) == 3))  # of four, read at once
        return cls(Layout(native(tilts.alpha)), mirrors.native(), metal and metal.native())

    def __call__(
        self, pair: Pair, cos_i: Any, tilts: Tilts, most: Any, reflectance: Reflectance | None
    ) -> tuple[Any, Any]:
        """As `nonsymmetric`; the table knows ``most``."""
        x = self.layout.coordinates(pair.theta, pair.delta)
        total = _fourth_power(self.mirrors.at(*x)[0])
        pole, scale = reciprocals(greater(pair.sin_theta, POLE), 4 * cos_i * pair.cos_delta)
        single = scale * single_bounce(pair, tilts)
        total = pole * scale * pair.cos_delta * _horizons(pair) * total
        if reflectance is None or self.metal is None:
            return single + total, single + total
        once = reflectance.once(pair.length * pair.cos_delta)
        colour = [_fourth_power(root) for root in self.metal.at(*x, dr.sqrt(pair.length))]
        return single * once + total * type(once)(colour[: len(once)]), single + total


def _pairs(layout: Layout, alpha: float, shape: tuple) -> Pair:
    """The nodes of a table over theta, delta and, perhaps, the root of l; but for edges, a little inside."""
    Float: Any = type(layout.alpha)
    index = dr.arange(dr.uint32_array_t(Float), math.prod(shape))
    columns, depth = shape[1], math.prod(shape[2:])
    nodes = Layout(alpha).theta(np.minimum(np.linspace(0, 1, shape[0]), 1 - EDGE / shape[0]))
    nodes = np.minimum(nodes, HALF - 10 * INSIDE)
    theta = dr.gather(Float, Float(nodes.astype(np.float32)), index // (columns * depth))
    y = Float(index // depth % columns) / (columns - 1)
    delta = lesser(layout.delta(dr.minimum(y, 1 - EDGE / columns), theta), HALF - theta - INSIDE)
    length = dr.square(Float(index % depth) / (depth - 1)) if depth > 1 else Float(1)
    (sin, cos), (sin_delta, cos_delta) = dr.sincos(theta), dr.sincos(delta)
    return Pair(Float(1), Float(0), theta, sin, cos, delta, sin_delta, cos_delta, length)


def _straddled(values: Any, nodes: int) -> Any:
    """Values at nodes of the last axis, moved so that a curve is on both sides of its chords: half the error."""
    index = dr.arange(dr.uint32_array_t(type(values)), dr.width(values))
    inner = (index % nodes > 0) & (index % nodes < nodes - 1)
    before, after = (dr.gather(type(values), values, at, inner) for at in (index - 1, index + 1))
    return values - dr.select(inner, before - 2 * values + after, 0) / 16


def _horizons(pair: Pair) -> Any:
    """cos x cos y, cosines from the normal in the plane of the pair."""
    both, sides = pair.cos_theta * pair.cos_delta, pair.sin_theta * pair.sin_delta
    return greater(both - sides, 0) * (both + sides)


def _fourth_root(x: Any) -> Any:
    return dr.sqrt(dr.sqrt(greater(x, 0)))


def _fourth_power(x: Any) -> Any:
    return dr.square(dr.square(x))
