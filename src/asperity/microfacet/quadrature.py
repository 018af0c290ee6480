"""Fixed quadrature rules: a constant number of nodes makes an integral noise-free and differentiable."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, Any

import drjit as dr
import numpy as np

from .numerics import TINY, heading
from .tables import Table

if TYPE_CHECKING:
    from .distributions import Distribution

Rule = tuple[tuple[float, ...], tuple[float, ...]]
"""Nodes and weights on [0, 1]."""
RULES: set[int | Rule] = {4, 5, 6, 8, 12, 16}
"""Rules that models use in recorded loops, by number of nodes or whole: add yours, or `dr.freeze` misses them."""


@cache
def gauss_legendre(n: int) -> tuple[list[float], list[float]]:
    """Nodes and weights of the n-point Gauss-Legendre rule on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(n)
    return list(map(float, (x + 1) / 2)), list(map(float, w / 2))


@cache
def rule(n: int | Rule, number: Any) -> tuple[Any, Any]:
    """Nodes and weights, of ``n`` Gauss nodes or of another rule, as arrays of the type ``number``, made once."""
    nodes, weights = gauss_legendre(n) if isinstance(n, int) else n
    return number(nodes), number(weights)


def accumulate(term: Callable[[Any, Any], tuple], count: Any, start: tuple, captured: Any) -> tuple:
    """``start`` and, for each index below ``count``, ``term(index, captured)``: tuples, summed in a recorded loop.

    ``captured`` is all that the terms are computed from, where it may carry derivatives: arrays in tuples, lists and
    dataclasses. What a body takes from around it instead has no derivatives if the loop is in a virtual call, as BSDFs
    are in every render (Dr.Jit 1.5).
    """

    def add(index: Any, captured: Any, sums: tuple) -> tuple:
        return index + 1, captured, tuple(total + one for total, one in zip(sums, term(index, captured)))

    # -1: Dr.Jit then differentiates a sum backwards without storing its terms, if it starts from constants. With any
    # other number it aborts the process there, if the loop is in a virtual call.
    begin = type(count)(0), _with_own_derivatives(captured), tuple(dr.zeros(type(total)) for total in start)
    sums = dr.while_loop(begin, lambda index, *_: index < count, add, max_iterations=-1)[2]
    return tuple(total + more for total, more in zip(start, sums))


def _with_own_derivatives(tree: Any) -> Any:
    """The same values: a loop cannot share the derivatives of its state with what else is made of it (Dr.Jit 1.5)."""
    if isinstance(tree, tuple | list):
        return type(tree)(map(_with_own_derivatives, tree))
    if isinstance(tree, Table):
        return tree  # of another size than what is summed; all that is gathered from one adds up
    if is_dataclass(tree) and not isinstance(tree, type):
        return replace(tree, **{part.name: _with_own_derivatives(getattr(tree, part.name)) for part in fields(tree)})
    return tree + 0 if dr.is_array_v(tree) and dr.grad_enabled(tree) else tree


def integrate(f: Callable[[Any, Any], tuple], n: int | Rule, captured: Any, like: Any, nested: bool = False) -> tuple:
    """Integrals over [0, 1] of the functions that ``f(node, captured)`` returns as a tuple.

    By ``n`` Gauss nodes, or by another rule.

    ``like`` is a number of the type that ``f`` takes; ``captured`` is that of `accumulate`. A recorded loop runs as
    fast as ``n`` copies of ``f``, and compiles ten times faster; but where it is ``nested`` in another one, derivatives
    need the copies.
    """
    Float: Any = type(like)
    nodes, weights = gauss_legendre(n) if isinstance(n, int) else n
    if not dr.is_jit_v(like) or (nested and dr.grad_enabled(f(Float(nodes[0]), captured))):
        copies = (f(node, captured) for node in nodes)
        terms = [[weight * value for value in values] for values, weight in zip(copies, weights)]
        return tuple(map(sum, zip(*terms)))
    start = tuple(dr.zeros(type(value)) for value in f(Float(nodes[0]), captured))
    nodes, weights = rule(n, Float)  # type: ignore[assignment]
    size = dr.width(nodes)

    def term(index: Any, captured: Any) -> tuple:
        weight = dr.gather(Float, weights, index)
        return tuple(weight * value for value in f(dr.gather(Float, nodes, index), captured))

    return accumulate(term, dr.uint32_array_t(Float)(size), start, captured)


@dataclass
class Lanes:
    """All Gauss nodes of [0, 1] for all lanes of ``like``, side by side; of several ``parts`` of an integral, perhaps.

    Instead of a loop: for tables, of which there are few lanes, or where there is a loop already.
    """

    like: Any
    nodes: int
    parts: int = 1

    def __post_init__(self) -> None:
        Float, self.width = type(self.like), dr.width(self.like)
        self.node, self.weight = (
            dr.tile(Float(values), self.width * self.parts) for values in gauss_legendre(self.nodes)
        )

    def repeat(self, x: Any) -> Any:
        """The numbers of all lanes, for each node."""
        return dr.repeat(x, self.nodes * self.parts)

    def pick(self, options: Any) -> Any:
        """Of ``options``, one for each part, that of the part that a node is in."""
        index = dr.arange(dr.uint32_array_t(type(self.like)), self.width * self.parts * self.nodes)
        part, found = index // self.nodes % self.parts, options[0]
        for n, option in enumerate(options[1:], 1):
            found = dr.select(part == n, option, found)
        return found

    def sum(self, values: Any) -> Any:
        """Integral of what has these values at the nodes."""
        return dr.block_sum(values * self.weight, self.nodes * self.parts)


def over_normals(
    f: Callable[[Any, Any], tuple],
    distribution: Distribution,
    towards: Any,
    captured: Any,
    rings: int = 16,
    azimuths: int = 16,
) -> tuple:
    """Integrals of ``f(m, captured) D(m) m_z`` over all normals m, for ``f`` that returns a tuple, 0 if m.towards <= 0.

    What ``f`` gets is the normal over m_z, (x, y, 1): often that is all it needs.

    The normals of a ring have the same share of the facets, D m_z, within; chi is the azimuth from ``towards`` where
    the stretched distribution is isotropic. What of a ring faces that is the arc up to +-chi_0, all of it or less:

        sin(chi / 2) = sin(chi_0 / 2) sin(t / 2),    t evenly spaced, in every other ring half a step off:

    nodes are even around a whole ring, and dense at the ends of an arc, where ``f`` has a kink. If ``towards`` is the
    more grazing of two directions (`by_grazing`), what is reciprocal, or independent of the azimuth, stays so. Both
    numbers of nodes are even; ``captured`` is that of `integrate`.
    """
    vector: Any = type(towards)

    def ring(odd: int, u: Any, everything: Any) -> tuple:
        """The mean around it."""
        distribution, towards, captured = everything
        x, y = distribution.alpha_u * towards.x, distribution.alpha_v * towards.y
        along, across = heading(x, y)
        steepest = distribution.least_slope(u) * (x * along + y * across)
        square, terms = (1 + dr.minimum(towards.z / dr.maximum(steepest, TINY), 1)) / 2, []  # sin^2(chi_0 / 2)
        for step in range(azimuths // 2 + odd):
            half = math.pi * (step + (1 - odd) / 2) / azimuths  # t / 2
            sine = square * math.sin(half) ** 2
            cosine = dr.maximum(1 - sine, TINY)
            inverse = dr.rsqrt(cosine)
            share = dr.sqrt(square) * inverse * math.cos(half) if half < math.pi / 2 else 1  # dchi / dt
            sin = 2 * dr.sqrt(square) * math.sin(half) * cosine * inverse
            for side in (sin, -sin) if 0 < half < math.pi / 2 else (sin,):
                psi = along * (1 - 2 * sine) - across * side, across * (1 - 2 * sine) + along * side
                (x, y), weight = distribution.slopes(*psi, u)
                terms.append([share * (weight / azimuths) * value for value in f(vector(x, y, 1), captured)])
        return tuple(map(sum, zip(*terms)))

    nodes, weights = gauss_legendre(rings)
    Float: Any = type(towards.z)
    everything = (distribution, towards, captured)
    if not dr.is_jit_v(Float):
        found = [[w * value for value in ring(k % 2, u, everything)] for k, (u, w) in enumerate(zip(nodes, weights))]
        return tuple(map(sum, zip(*found)))
    nodes, weights = rule(rings, Float)

    def both(index: Any, everything: Any) -> tuple:
        """Two rings."""
        found = []
        for odd in (0, 1):
            u, weight = (dr.gather(Float, values, 2 * index + odd) for values in (nodes, weights))
            found.append([weight * value for value in ring(odd, u, everything)])
        return tuple(map(sum, zip(*found)))

    start = tuple(dr.zeros(type(value)) for value in f(towards, captured))
    return accumulate(both, dr.uint32_array_t(Float)(rings // 2), start, everything)


def by_grazing(distribution: Distribution, i: Any, o: Any) -> tuple[Any, Any]:
    """Two directions, first the one that faces fewer of the normals."""
    tilt_i, tilt_o = (dr.square(distribution.alpha_u * w.x) + dr.square(distribution.alpha_v * w.y) for w in (i, o))
    first = dr.square(i.z) * tilt_o < dr.square(o.z) * tilt_i
    return dr.select(first, i, o), dr.select(first, o, i)
