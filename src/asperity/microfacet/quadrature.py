"""Fixed quadrature rules: a constant number of nodes makes an integral noise-free and differentiable."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, Any

import drjit as dr
import numpy as np

from .numerics import heading

if TYPE_CHECKING:
    from .distributions import Distribution

RULES = (4, 5, 6, 8, 12, 16)
"""Numbers of nodes that models use in recorded loops: add yours, or `dr.freeze` does not find them."""


@cache
def gauss_legendre(n: int) -> tuple[list[float], list[float]]:
    """Nodes and weights of the n-point Gauss-Legendre rule on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(n)
    return list(map(float, (x + 1) / 2)), list(map(float, w / 2))


@cache
def rule(n: int, number: Any) -> tuple[Any, Any]:
    """The nodes and weights as arrays of the type ``number``, made once."""
    nodes, weights = gauss_legendre(n)
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
    if is_dataclass(tree) and not isinstance(tree, type):
        return replace(tree, **{part.name: _with_own_derivatives(getattr(tree, part.name)) for part in fields(tree)})
    return tree + 0 if dr.is_array_v(tree) and dr.grad_enabled(tree) else tree


def integrate(f: Callable[[Any, Any], tuple], n: int, captured: Any, like: Any, nested: bool = False) -> tuple:
    """Integrals over [0, 1] of the functions that ``f(node, captured)`` returns as a tuple, by ``n`` Gauss nodes.

    ``like`` is a number of the type that ``f`` takes; ``captured`` is that of `accumulate`. A recorded loop runs as
    fast as ``n`` copies of ``f``, and compiles ten times faster; but where it is ``nested`` in another one, derivatives
    need the copies.
    """
    return _integrate(lambda node, _, captured: f(node, captured), n, captured, like, nested)


@dataclass
class Lanes:
    """All Gauss nodes of [0, 1] for all lanes of ``like``, side by side; of several ``parts`` of an integral, perhaps.

    Instead of a loop: for tables, of which there are few lanes, or a loop already.
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
        """What belongs to the part."""
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
    rings: int = 8,
    azimuths: int = 32,
    nested: bool = False,
) -> tuple:
    """Integrals of ``f(m, captured) D(m) m_z`` over all normals m above the horizon, for ``f`` that returns a tuple.

    The normals of a ring have the same share of the facets, D m_z, within; they are evenly spaced where the stretched
    distribution is isotropic, and so a kink of ``f`` along <w.m> = 0 is where all of them look alike. Every other ring
    is turned by half a step. They come in pairs m, (-m_x, -m_y, m_z), the facets of a V-cavity. The first normal is
    half a step from the azimuth of ``towards``: take the more grazing of two directions, and what is reciprocal, or
    independent of the azimuth, stays so. ``azimuths`` are even; ``captured`` and ``nested`` are those of `integrate`.
    """
    vector: Any = type(towards)
    start = heading(distribution.alpha_u * towards.x, distribution.alpha_v * towards.y)

    def ring(u: Any, index: Any, everything: Any) -> tuple:
        distribution, (x, y), captured = everything
        odd, terms = index % 2 == 1, []
        for step in range(azimuths // 2):
            turns = (_turned(x, y, 2 * math.pi * (step + half) / azimuths) for half in (1, 0.5))
            psi = (dr.select(odd, *either) for either in zip(*turns))
            cos_phi, sin_phi, alpha = distribution.stretched_azimuth(*psi)
            (sin, cos), weight = distribution.tilt_node(alpha, u)
            m = vector(sin * cos_phi, sin * sin_phi, cos)
            for normal in (m, vector(-m.x, -m.y, m.z)):
                terms.append([weight / azimuths * value for value in f(normal, captured)])
        return tuple(map(sum, zip(*terms)))

    return _integrate(ring, rings, (distribution, start, captured), towards.z, nested)


def _turned(x: Any, y: Any, angle: float) -> tuple[Any, Any]:
    sin, cos = math.sin(angle), math.cos(angle)
    return x * cos - y * sin, x * sin + y * cos


def _integrate(f: Callable[[Any, Any, Any], tuple], n: int, captured: Any, like: Any, nested: bool) -> tuple:
    """`integrate` for ``f(node, index, captured)``."""
    Float: Any = type(like)
    nodes, weights = gauss_legendre(n)
    if not dr.is_jit_v(like) or (nested and dr.grad_enabled(f(Float(nodes[0]), 0, captured))):
        copies = (f(node, index, captured) for index, node in enumerate(nodes))
        terms = [[weight * value for value in values] for values, weight in zip(copies, weights)]
        return tuple(map(sum, zip(*terms)))
    start = tuple(dr.zeros(type(value)) for value in f(Float(nodes[0]), 0, captured))
    nodes, weights = rule(n, Float)

    def term(index: Any, captured: Any) -> tuple:
        weight = dr.gather(Float, weights, index)
        return tuple(weight * value for value in f(dr.gather(Float, nodes, index), index, captured))

    return accumulate(term, dr.uint32_array_t(Float)(n), start, captured)
