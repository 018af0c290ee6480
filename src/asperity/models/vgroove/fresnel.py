"""The product of a metal's reflectances over all bounces in a groove, in closed form.

Not in the paper, which multiplies them one by one. At the j-th of k bounces the cosine of incidence is l sin theta_j,
with equally spaced angles theta_j = phi + (2 j - k - 1) b. Where ln F(c) = sum_n a_n c^n, the logarithm of the product
is made of sums over j of powers of sin theta_j; these are sums of sin(n theta_j) and cos(n theta_j), which are closed:

    sum_j e^(i n theta_j) = e^(i n phi) sin(n k b) / sin(n b).

The kaleidoscope gives u = phi - pi/2 and w = pi/2 - k b instead of phi and k b. With them the numerators are

    sin(n phi) sin(n k b) = cos(n u) cos(n w) for odd n,   cos(n phi) sin(n k b) = -cos(n u) sin(n w) for even n.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr
import numpy as np

from ...microfacet.fast import exp_of_negative, lesser, polynomial
from ...microfacet.fresnel import Metal, by_channel, constants

DEGREE = 6
NODES = (np.cos(np.pi * (np.arange(DEGREE + 1) + 0.25) / (DEGREE + 1.5)) + 1) / 2
FIT = np.linalg.pinv(NODES[:, None] ** np.arange(1, DEGREE + 1))
"""From ln F at the nodes to a_1..a_6; F(0) = 1, so a_0 = 0. The worst error of all c: .06 % of gold's F, .1 % of
copper's, 1 % of aluminium's and chromium's, 3 % of tellurium's, whose F turns sharply near grazing angles."""
POWERS = 8
FEW_NODES = (np.cos(np.pi * (np.arange(24) + 0.5) / 24) + 1) / 2
FIT_FEW = np.linalg.pinv(FEW_NODES[:, None] ** np.arange(1, POWERS + 1))
"""From F - 1 at the nodes to the coefficients of a polynomial without a constant term."""
ALLOWED = 3e-4
"""Largest error of that polynomial, of F itself: gold's is 9e-5, copper's 1.2e-4, silver's 2e-4."""
TURNED = (1, -1, -1, 1, 1, -1)
"""sin(n phi) of odd n, cos(n phi) of even n, over cos(n u), for n = 1..6."""


class Reflectance(NamedTuple):
    """Reflectances of the facets at a surface point."""

    once: Callable  # cosine -> spectrum
    logarithm: Any  # a_1..a_6, spectra
    power: Any = None  # p_1..p_8 in F(c) = 1 + sum_n p_n c^n, if that is close, and the same everywhere

    def few(self, cos: Any) -> Any:
        """The same as ``once``, perhaps less exact, for paths of a few bounces."""
        return self.once(cos) if self.power is None else polynomial(cos, [1, *self.power])


def fit(once: Callable) -> list:
    """The coefficients a_1..a_6 of ln F, for the reflectance ``once``."""
    logs = [dr.log(dr.maximum(once(float(cos)), 1e-6)) for cos in NODES]
    return [sum(weight * log for weight, log in zip(row, logs)) for row in FIT.tolist()]


def fit_power(once: Callable) -> list:
    """The coefficients p_1..p_8 of F, for the reflectance ``once``."""
    values = [once(float(cos)) for cos in FEW_NODES]
    return [sum(w * (value - 1) for w, value in zip(row, values)) for row in FIT_FEW.tolist()]


def fit_constant(metal: Metal) -> tuple[list, list | None]:
    """Both fits of a metal that is the same everywhere; None for that of F if it is not good to `ALLOWED`."""
    cos = dr.scalar.ArrayXf64(FEW_NODES)
    good = all(
        dr.all(dr.abs(polynomial(cos, [1, *fit_power(channel)]) / channel(cos) - 1) < ALLOWED)
        for channel in by_channel(metal)
    )
    found = constants(lambda metal: fit(metal) + fit_power(metal), metal)
    return found[:DEGREE], found[DEGREE:] if good else None


def waves(logarithm: Any, length: Any) -> list:
    """Coefficients in ln F(length sin theta) = e_0 + e_1 sin theta + e_2 cos 2 theta + e_3 sin 3 theta + ..."""
    a1, a2, a3, a4, a5, a6 = (a * length**n for n, a in enumerate(logarithm, 1))
    return [
        a2 / 2 + a4 * (3 / 8) + a6 * (10 / 32),
        a1 + a3 * (3 / 4) + a5 * (10 / 16),
        a2 * (-1 / 2) - a4 / 2 - a6 * (15 / 32),
        a3 * (-1 / 4) - a5 * (5 / 16),
        a4 / 8 + a6 * (6 / 32),
        a5 / 16,
        a6 * (-1 / 32),
    ]


def multiples(sin: Any, cos: Any) -> list[tuple]:
    """(sin n x, cos n x) for n = 1..6."""
    found = [(sin, cos)]
    for _ in range(DEGREE - 1):
        s, c = found[-1]
        found.append((dr.fma(s, cos, c * sin), dr.fma(c, cos, -s * sin)))
    return found


def numerators(u: list[tuple], w: list[tuple]) -> list:
    """Those of the closed sums for n = 1..6, from the `multiples` of u and w."""
    return [cos_u * (cos_w if n % 2 else -sin_w) for n, ((_, cos_u), (sin_w, cos_w)) in enumerate(zip(u, w), 1)]


class Fan(NamedTuple):
    """The mirror images that a path meets, by what the closed sums are made of; lists are for n = 1..6."""

    k: Any  # how many
    odd: Any  # whether k is
    numerators: list
    cos_u: list  # cos(n u)
    b: list  # (sin n b, cos n b)


def product(e: list, fan: Fan) -> Any:
    """Product of all reflectances, for the coefficients ``e`` of `waves`."""
    logarithm = fan.k * e[0]
    for n, (numerator, cos_u, (sin, cos)) in enumerate(zip(fan.numerators, fan.cos_u, fan.b), 1):
        # Where sin(n b) vanishes, the k terms are alike. For odd k they are that of n phi. For even k, n theta_j is an
        # odd multiple of n b off n phi: another sign if n b is an odd number of half turns, whose cosine is -1.
        regular = dr.abs(sin) > 1e-3
        alike = fan.k * dr.select(fan.odd | (cos > 0), cos_u, -cos_u) * TURNED[n - 1]
        logarithm = logarithm + e[n] * dr.select(regular, numerator / dr.select(regular, sin, 1), alike)
    return dr.exp(dr.minimum(logarithm, 0))


def with_partner(mean: Any, half: Any) -> list:
    """(mean + half)^n + (mean - half)^n for n = 1..6."""
    x, y = mean * mean, half * half
    first, second, square = 2 * mean, 2 * (x + y), x * x
    return [
        first,
        second,
        first * dr.fma(3, y, x),
        2 * dr.fma(y, dr.fma(6, x, y), square),
        first * dr.fma(y, 5 * dr.fma(2, x, y), square),
        second * dr.fma(y, dr.fma(14, x, y), square),
    ]


def through(logarithm: Any, powers: list) -> Any:
    """Product of the reflectances at some cosines, of which these are the sums of powers 1..6."""
    return exp_of_negative(lesser(total(logarithm, powers), 0))


def total(a: Any, b: Any) -> Any:
    """Sum of products; in this order, spectra are multiplied by numbers."""
    found = a[0] * b[0]
    for one, other in zip(a[1:], b[1:]):
        found = dr.fma(one, other, found)
    return found


@dataclass
class Path:
    """The product of a long path's reflectances, in a groove of any width that leads from one direction to the other.

    The cosines of its bounces are l sin of angles 2 b apart, the first one b beyond x, the last one b before
    pi - y. So the sum of f = ln F is, by Euler and Maclaurin,

        int f / (2 b) - b [f'] / 12 + 7 b^3 [f^(3)] / 720,   between x and pi - y.

    With h_n = sin^(n-1) x cos x + sin^(n-1) y cos y, of sin^n the integral is I_n = ((n - 1) I_(n-2) + h_n) / n, the
    first bracket -n h_n, and the other one -n ((n - 1) (n - 2) h_(n-2) - n^2 h_n).
    """

    along: Any
    ends: Any
    bends: Any

    @classmethod
    def of(cls, logarithm: Any, length: Any, x: tuple, y: tuple, angle: Any) -> Path:
        """Between x and y, each a sine and cosine, which are ``angle`` = pi - x - y apart."""
        slopes, integrals, power, (at_x, at_y) = [0, 0], [angle], length, (x[1], y[1])
        along, ends, bends = list[Any](), list[Any](), list[Any]()
        for n in range(1, DEGREE + 1):
            slopes.append(at_x + at_y)
            before, _, slope = slopes[-3:]
            integrals.append(slope if n == 1 else dr.fma((n - 1) / n, integrals[-2], slope * (1 / n)))
            third = n * n * slope if n < 3 else dr.fma(n * n, slope, -(n - 1) * (n - 2) * before)
            along.append(0.5 * power * integrals[-1])
            ends.append((n / 12) * power * slope)
            bends.append((7 * n / 720) * power * third)
            at_x, at_y, power = at_x * x[0], at_y * y[0], power * length
        return cls(total(logarithm, along), total(logarithm, ends), total(logarithm, bends))

    def __call__(self, b: Any, inverse: Any) -> Any:
        """The product, for b and 1 / b."""
        return exp_of_negative(lesser(dr.fma(self.along, inverse, b * dr.fma(self.bends, b * b, self.ends)), 0))
