"""Elementary functions that Dr.Jit lacks, accurate in float32 near zero, in value and in gradient.

They take and return plain floats or Dr.Jit arrays of any precision.
"""

from __future__ import annotations

from typing import Any

import drjit as dr

TINY = 1e-20
"""Least divisor, far below what is divided by it."""
ONE_BELOW = 1 - 2**-24
"""The float32 next to 1: random numbers are in [0, 1)."""
SMALL = 0.03
"""Below this the Taylor series is used: its error, x⁴/5 relative, equals the rounding of the direct form above it."""

SHORTEST = 1e-14
"""Square of the sine below which a direction is the normal: the rounding of its components in float32."""


def log1p(x: Any) -> Any:
    """log(1 + x) for x > -1."""
    series = x * (1 + x * (-1 / 2 + x * (1 / 3 + x * (-1 / 4 + x * (1 / 5)))))
    return dr.select(dr.abs(x) < SMALL, series, dr.log(1 + x))


def one_minus_exp(x: Any) -> Any:
    """1 - exp(-x) for x >= 0."""
    series = x * (1 - x * (1 / 2 - x * (1 / 6 - x * (1 / 24))))
    return dr.select(x < SMALL, series, 1 - dr.exp(-x))


def clamp(x: Any, low: Any, high: Any) -> Any:
    """``x`` within [low, high]. Unlike that of Dr.Jit's, the derivative at both ends is that of the values within."""
    return dr.select(x < low, low, dr.select(x > high, high, x))


def keep(x: Any, low: Any, high: Any) -> Any:
    """``x`` moved into [low, high], where a formula is finite; derivatives are as if it had not been moved."""
    kept = clamp(x, low, high)
    return dr.replace_grad(kept, x) if dr.is_diff_v(x) else kept


def normalised(x: Any, y: Any) -> tuple[Any, Any]:
    """The unit vector along (x, y), as a pair."""
    scale = dr.rsqrt(dr.square(x) + dr.square(y))
    return x * scale, y * scale


def heading(x: Any, y: Any, otherwise: tuple[Any, Any] = (1, 0)) -> tuple[Any, Any]:
    """The unit vector along (x, y), as a pair; ``otherwise`` where that is too short to have a direction."""
    square = dr.square(x) + dr.square(y)
    defined = square > SHORTEST
    scale = dr.rsqrt(dr.select(defined, square, 1))
    return dr.select(defined, x * scale, otherwise[0]), dr.select(defined, y * scale, otherwise[1])
