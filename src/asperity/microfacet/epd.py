"""What the exponential power distribution of normals needs of its exponent p alone, tabulated.

With slopes in units of the roughness and x their square, facets have the density P22 = p / (pi Gamma(1/p)) exp(-x^p)
by slope (Holzschuch and Pacanowski 2017, Eq. 34). Smith's Lambda and the inverse of the distribution have no closed
form.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import drjit as dr

from .numerics import clamp, log1p, one_minus_exp
from .quadrature import Lanes
from .tables import Table, native

NODES = 64
"""Of either table: 1 + Lambda is good to 5e-4, .0012 at worst, the density of draws to 1e-4."""
RULE = 32
"""Nodes of the integral that is Lambda: 1e-6."""
NEWTON, TERMS = 12, 120
"""Steps of the inversion by which draws are tabulated, and terms of the series of the incomplete gamma function."""
FIRST, LAST = math.log(1e-7), math.log(17)
"""Logarithms of v = -log(1 - u), between which draws are tabulated: all but one in 10^7 of them."""


@dataclass
class Profile:
    """P22 of the exponent p, 0.2 to 5: 1 is a Gaussian, less has a peak and long tails, more is flat and ends."""

    p: Any
    density: Any  # where slopes vanish, p / (pi Gamma(1/p))

    @classmethod
    def of(cls, p: Any) -> Profile:
        """For the exponent ``p``."""
        return cls(p, p * dr.exp(-dr.lgamma(1 / p)) / dr.pi)

    def __call__(self, x: Any) -> Any:
        """P22 at the squared slope ``x``."""
        # A power has no derivative at 0; and where e^7 is exceeded, 0.
        return self.density * dr.exp(-dr.exp(dr.minimum(self.p * dr.log(dr.maximum(x, 1e-20)), 7)))

    def density_of_tilts(self, alpha: Any, sin: Any, cos: Any) -> Any:
        """D per steradian, of roughness ``alpha``, at the tilt with this sine and cosine."""
        square = dr.square(dr.maximum(cos, 1e-6))  # tails may be long, but nothing that matters is beyond
        return self(dr.square(sin / alpha) / square) * dr.square(dr.rcp(alpha * square))

    def variance(self) -> Any:
        """Mean of x."""
        return dr.exp(dr.lgamma(2 / self.p) - dr.lgamma(1 / self.p))


@dataclass
class Power:
    """All that depends on p."""

    profile: Profile
    masking: Table  # G1 (1 + t) over sqrt(t / (1 + t)), with t = alpha tan(theta)
    squares: Table  # (log x, its derivative) over log v

    @classmethod
    def of(cls, p: Any) -> Power:
        """For the exponent ``p``, a Dr.Jit array of one number; draws have no derivatives by it."""
        return cls(Profile.of(p), masking_table(p), squares_table(dr.detach(p)))

    def native(self) -> Power:
        """The same for the active variant."""
        profile = Profile(native(self.profile.p), native(self.profile.density))
        return Power(profile, self.masking.native(), self.squares.native())

    def smith_lambda(self, slope: Any, cos: Any) -> Any:
        """Lambda >= 0 of a direction of this cosine, whose sine times the roughness along it is ``slope``."""
        total = cos + slope
        (g,) = self.masking.at(dr.sqrt(slope / total))
        return dr.maximum(total / (g * cos) - 1, 0)

    def sample(self, u: Any) -> Any:
        """The squared slope x that a share ``u`` in [0, 1) of the facets' projected area is below."""
        v = clamp(-log1p(-u), math.exp(FIRST), math.exp(LAST))
        return dr.exp(self.squares.cubic((dr.log(v) - FIRST) / (LAST - FIRST)))


def smith_lambda(p: Any, t: Any) -> Any:
    """Lambda for t = alpha tan(theta) > 0, an integral over slopes s from 1 / t on; Gauss nodes in sqrt(log(s t)).

    Of the facets of slope s the share beyond the horizon projects to T - atan T, T^2 = (s t)^2 - 1 (Eq. 36 and 37).
    """
    lanes = Lanes(t, RULE)
    t = lanes.repeat(t)
    first = dr.exp(-2 * p * dr.log(t))
    extent = log1p(25 / first) / (2 * p)  # where facets are e^-25 times as many
    log_s = extent * dr.square(lanes.node)
    tangent = dr.sqrt(dr.exp(2 * log_s) * one_minus_exp(2 * log_s))
    facets = dr.exp(2 * log_s - first * dr.exp(2 * p * log_s)) / dr.square(t)
    integrand = 2 * facets * (tangent - dr.atan(tangent)) * 2 * extent * lanes.node
    return lanes.sum(integrand) * p * dr.exp(-dr.lgamma(1 / p)) / dr.pi


def masking_table(p: Any) -> Table:
    """G1 (1 + t) over sqrt(t / (1 + t)); both ends are exact."""
    Float, (double,) = type(p), _double(p)
    share = dr.square(dr.linspace(type(double), 0, 1, NODES))
    first, last = share == 0, share == 1
    t = share / dr.select(last, 1, 1 - share)
    g = (1 + t) / (1 + smith_lambda(double, dr.select(first | last, 1, t)))
    end = dr.pi * dr.exp(dr.lgamma(1 / double) - dr.lgamma(1.5 / double))
    return Table.of([NODES], [Float(dr.select(first, 1, dr.select(last, end, g)))])


def squares_table(p: Any) -> Table:
    """log x and its derivative, by Newton's method from where log v = log x - log Gamma(1 + 1/p), of small x."""
    Float, (p,) = type(p), _double(p)
    log_v = dr.linspace(type(p), FIRST, LAST, NODES)
    log_gamma = dr.lgamma(1 + 1 / p)
    log_x = dr.minimum(log_v + log_gamma, dr.log(dr.exp(log_v) + 2) / p)
    for _ in range(NEWTON):
        v, slope = exceedance(p, log_gamma, log_x)
        log_x = log_x + (log_v - dr.log(v)) * slope
    _, slope = exceedance(p, log_gamma, log_x)
    return Table.of([NODES], [Float(log_x), Float(slope * (LAST - FIRST))])


def exceedance(p: Any, log_gamma: Any, log_x: Any) -> tuple[Any, Any]:
    """(v = -log of the projected area that is steeper, d log x / d log v), in double precision.

    The area below x is the incomplete gamma function P(1/p, x^p), the series x e^-y sum_n y^n / ((a)_n+1 / a) /
    Gamma(1 + a), y = x^p, a = 1/p.
    """
    y, a = dr.exp(p * log_x), 1 / p

    def add(n: Any, term: Any, total: Any) -> tuple:
        term = term * y / (a + n)
        return n + 1, term, total + term

    one = dr.ones(type(log_x), dr.width(log_x))
    *_, total = dr.while_loop((type(p)(1), one, one), lambda n, *_: n < TERMS, add)
    density = dr.exp(log_x - y - log_gamma)  # of log x
    steeper = 1 - density * total
    v = -log1p(-density * total)
    return v, v * steeper / density


def _double(*numbers: Any) -> list:
    return [dr.float64_array_t(type(number))(number) for number in numbers]
