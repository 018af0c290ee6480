"""Elementary functions for the ranges that models need, several times as fast as Dr.Jit's own, and differentiable.

What operations cost on a core with AVX-512, in cycles for 16 lanes: a product or sum .5 to 1, a selection 2, a division
15, a square root 16, atan2 58, sincos 83. So: divide once for several quotients, and leave out what a range rules out.
Errors are worst ones over the whole range, in float32; the tests measure them.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate
from operator import mul
from typing import Any

import drjit as dr

TWICE_ARC_TANGENT = (
    1.9999998,
    -0.6666398148,
    0.3993944767,
    -0.2803896104,
    0.1982858344,
    -0.1189727536,
    0.0485047824,
    -0.0093865452,
)
"""2 atan(t) / t by powers of t^2, for t in [0, 1]: fitted for the least relative error (tests/microfacet/test_fast.py
fits it anew)."""


ARC_COSINE = (
    1.5707962162,
    -0.9999815164,
    0.7848809746,
    -0.6609692088,
    0.5565558543,
    -0.423582284,
    0.2520860876,
    -0.0972649228,
    0.0174788696,
)
"""arccos(c) / sqrt(1 - c^2) by powers of c, for c in [0, 1]; fitted likewise."""


def polynomial(x: Any, coefficients: Sequence[Any]) -> Any:
    """Sum of ``coefficients[n] * x**n``."""
    total = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        total = dr.fma(total, x, coefficient)
    return total


def lesser(a: Any, b: Any) -> Any:
    """``dr.minimum`` without its care for NaN, a third of its instructions: ``b`` if either is not a number."""
    return dr.select(a < b, a, b)


def greater(a: Any, b: Any) -> Any:
    """``dr.maximum`` without its care for NaN: ``b`` if either is not a number."""
    return dr.select(a > b, a, b)


def reciprocals(*xs: Any) -> list:
    """1 / x of each, by one division; all products of some of them must be within 1e-37 and 1e38."""
    before = list(accumulate(xs, mul))
    inverse, found = dr.rcp(before.pop()), []
    while before:
        found.append(inverse * before.pop())
        inverse = inverse * xs[len(before) + 1]
    return [inverse, *reversed(found)]


def sincos(x: Any) -> tuple[Any, Any]:
    """(sin x, cos x) for x in [-3.5, 3.5], to 8e-7: Taylor's series at x / 4, its angle doubled twice."""
    y = 0.25 * x
    z = y * y
    sin = y * polynomial(z, (1, -1 / 6, 1 / 120, -1 / 5040, 1 / 362880))
    versine = z * polynomial(
        z, (1 / 2, -1 / 24, 1 / 720, -1 / 40320, 1 / 3628800)
    )  # 1 - cos, which keeps its digits near 0
    for _ in range(2):
        sin, versine = 2 * sin * (1 - versine), 2 * sin * sin
    return sin, 1 - versine


def acute_sincos(x: Any) -> tuple[Any, Any]:
    """(sin x, cos x) for x in [0, 1.1], to 2e-7: Taylor's series."""
    z = x * x
    sin = x * polynomial(z, (1, -1 / 6, 1 / 120, -1 / 5040, 1 / 362880))
    return sin, polynomial(z, (1, -1 / 2, 1 / 24, -1 / 720, 1 / 40320, -1 / 3628800))


def angles(*points: tuple[Any, Any]) -> list:
    """Angle in [0, pi] of each unit vector (cos, sin), sin >= 0, to 3e-7 of itself; by one division."""
    halves = [sin * inverse for (_, sin), inverse in zip(points, reciprocals(*(1 + dr.abs(cos) for cos, _ in points)))]
    acute = [tan * polynomial(tan * tan, TWICE_ARC_TANGENT) for tan in halves]
    return [dr.select(cos < 0, dr.pi - angle, angle) for (cos, _), angle in zip(points, acute)]


def acute_angle(cos: Any, sin: Any) -> Any:
    """Angle in [0, pi / 2] of a unit vector, to 3e-7 of itself; without a division."""
    return sin * polynomial(cos, ARC_COSINE)


def angle(cos: Any, sin: Any) -> Any:
    """Angle in [0, pi] of a unit vector, sin >= 0, to 3e-7 of itself; without a division."""
    acute = acute_angle(dr.abs(cos), sin)
    return dr.select(cos < 0, dr.pi - acute, acute)


def exp_of_negative(x: Any) -> Any:
    """exp(x) for x <= 0, to 4e-6 of itself above -3 and 2e-6 of 1 everywhere: Taylor's series at x / 32."""
    return _exp_by_squares(greater(x * (1 / 32), -0.75), 5)


def exp_of_moderate(x: Any) -> Any:
    """exp(x) for x in [-2.5, 2.5], to 1.6e-5 of itself, and 3e-6 in [-1.5, 1.5]: Taylor's series at x / 16."""
    return _exp_by_squares(x * (1 / 16), 4)


def _exp_by_squares(x: Any, squares: int) -> Any:
    """exp(2^squares x) for small x."""
    power = polynomial(x, (1, 1, 1 / 2, 1 / 6, 1 / 24))
    for _ in range(squares):
        power = power * power
    return power
