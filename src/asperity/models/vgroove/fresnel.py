"""The product of a metal's reflectances over all bounces in a groove, in closed form.

Not in the paper, which multiplies them one by one. With ln F(c) = sum_n a_n c^n, the product over equally spaced angles
is the exponential of sums of powers of their sines, and those are closed:

    sum_j e^(i n theta_j) = e^(i n phi) sin(n k b) / sin(n b),   theta_j = phi + (2 j - k - 1) b,   j = 1..k.

Written with u = phi - pi/2 and w = pi/2 - k b, the angles that the kaleidoscope gives.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import drjit as dr
import numpy as np

DEGREE = 6
NODES = (np.cos(np.pi * (np.arange(DEGREE + 1) + 0.25) / (DEGREE + 1.5)) + 1) / 2
FIT = np.linalg.pinv(NODES[:, None] ** np.arange(1, DEGREE + 1)).tolist()
"""From ln F at the nodes to a_1..a_6; F(0) = 1, so a_0 = 0. The worst error of all c: .06 % of gold's F, .1 % of
copper's, 1 % of aluminium's and chromium's, whose F turns sharply near grazing angles."""


class Metal(NamedTuple):
    """Reflectances at a surface point."""

    once: Callable  # cosine -> spectrum
    logarithm: Any  # a_1..a_6, spectra


def fit(once: Callable) -> list:
    """The coefficients a_1..a_6 of ln F, for the reflectance ``once``."""
    logs = [dr.log(dr.maximum(once(float(cos)), 1e-6)) for cos in NODES]
    return [sum(weight * log for weight, log in zip(row, logs)) for row in FIT]


def waves(logarithm, length) -> list:
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


def multiples(sin, cos) -> list[tuple]:
    """(sin n x, cos n x) for n = 1..6."""
    found = [(sin, cos)]
    for _ in range(DEGREE - 1):
        s, c = found[-1]
        found.append((s * cos + c * sin, c * cos - s * sin))
    return found


def product(e, k, odd, bends, tops, b):
    """Product of k reflectances, for the coefficients ``e`` of `waves`; ``odd`` tells whether k is.

    For n = 1..6, ``bends`` are cos(n u) cos(n w) for odd n and -cos(n u) sin(n w) for even n, ``tops`` are cos(n u),
    and ``b`` are the `multiples` of b. Where sin(n b) vanishes, the sum has k terms of the same magnitude.
    """
    total = k * e[0]
    for n, (bend, top, (sin, cos)) in enumerate(zip(bends, tops, b), 1):
        regular = dr.abs(sin) > 1e-3
        peak = k * dr.select(odd | (cos > 0), top, -top) * (1 if n in (1, 4, 5) else -1)
        total = total + e[n] * dr.select(regular, bend / dr.select(regular, sin, 1), peak)
    return dr.exp(dr.minimum(total, 0))
