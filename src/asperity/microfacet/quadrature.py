"""Fixed quadrature rules: a constant number of nodes makes an integral noise-free and differentiable."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, Any

import drjit as dr
import numpy as np

from .fast import sincos
from .numerics import TINY, heading
from .tables import Table

if TYPE_CHECKING:
    from .distributions import Distribution

Rule = tuple[tuple[float, ...], tuple[float, ...]]
"""Nodes and weights on [0, 1]."""
RULES: set[int | Rule] = {4, 5, 6, 8, 12, 16}
"""Rules that models use in recorded loops, by number of nodes or whole: add yours, or `dr.freeze` misses them."""


TURN = 1e-5
"""Less than the sine of any angle between nodes, and more than the rounding of 0."""


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
    Float: Any = type(towards.z)
    halves = [np.pi * (np.arange(azimuths // 2 + odd) + (1 - odd) / 2) / azimuths for odd in (0, 1)]  # t / 2
    steps = [list(zip(np.sin(half).tolist(), np.cos(half).tolist())) for half in halves]

    def around(steps: list, u: Any, everything: Any) -> tuple:
        """What the nodes at +-t of a ring add to its mean, for some (sin(t / 2), cos(t / 2))."""
        distribution, towards, captured = everything
        x, y = distribution.alpha_u * towards.x, distribution.alpha_v * towards.y
        along, across = heading(x, y)
        steepest = distribution.least_slope(u) * (x * along + y * across)
        facing = dr.minimum(towards.z / dr.maximum(steepest, TINY), 1)
        square, rest, terms = (1 + facing) / 2, (1 - facing) / 2, []  # sin^2(chi_0 / 2), cos^2
        root = dr.sqrt(square)
        for sin_t, cos_t in steps:
            sine = square * (sin_t * sin_t)  # sin^2(chi / 2)
            cosine = dr.maximum(rest + square * (cos_t * cos_t), TINY)
            inverse = dr.rsqrt(cosine)
            share = dr.select(cos_t > TURN, root * inverse * cos_t, 1) / azimuths  # dchi / dt
            sin, cos, once = 2 * root * sin_t * cosine * inverse, 1 - 2 * sine, (sin_t < TURN) | (cos_t < TURN)
            for side in (sin,) if once is True else (sin, -sin):
                (x, y), weight = distribution.slopes(along * cos - across * side, across * cos + along * side, u)
                if dr.is_array_v(once):  # of two nodes that are one, half
                    weight = dr.select(once, weight / 2, weight)
                terms.append([share * weight * value for value in f(vector(x, y, 1), captured)])
        return tuple(map(sum, zip(*terms)))

    everything = (distribution, towards, captured)
    if not dr.is_jit_v(Float):
        rings_and_weights = zip(*gauss_legendre(rings))
        found = [[w * x for x in around(steps[k % 2], u, everything)] for k, (u, w) in enumerate(rings_and_weights)]
        return tuple(map(sum, zip(*found)))
    nodes, weights = rule(rings, Float)

    def on(ring: Any, steps: list, everything: Any) -> list:
        u, weight = (dr.gather(Float, values, ring) for values in (nodes, weights))
        return [weight * value for value in around(steps, u, everything)]

    def two_rings(index: Any, everything: Any) -> tuple:
        return tuple(map(sum, zip(*(on(2 * index + odd, steps[odd], everything) for odd in (0, 1)))))

    def one_step(index: Any, everything: Any) -> tuple:
        """Slower, but with derivatives two rings compile ten times as long."""
        pair, step = index // (azimuths + 1), Float(index % (azimuths + 1))
        odd = step > azimuths / 2 - 0.25
        half = dr.select(odd, step - azimuths // 2, step + 0.5) * (math.pi / azimuths)
        return tuple(on(2 * pair + dr.select(odd, type(index)(1), 0), [sincos(half)], everything))

    first = f(towards, captured)
    start = tuple(dr.zeros(type(value)) for value in first)
    differentiated = dr.grad_enabled(first) or dr.grad_enabled(distribution)
    term, count = (one_step, rings // 2 * (azimuths + 1)) if differentiated else (two_rings, rings // 2)
    return accumulate(term, dr.uint32_array_t(Float)(count), start, everything)


def by_grazing(distribution: Distribution, i: Any, o: Any) -> tuple[Any, Any]:
    """Two directions, first the one that faces fewer of the normals."""
    tilt_i, tilt_o = (dr.square(distribution.alpha_u * w.x) + dr.square(distribution.alpha_v * w.y) for w in (i, o))
    first = dr.square(i.z) * tilt_o < dr.square(o.z) * tilt_i
    return dr.select(first, i, o), dr.select(first, o, i)
