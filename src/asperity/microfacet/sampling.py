"""Random directions, and more random numbers than Mitsuba hands out.

Arguments are Dr.Jit arrays of any precision, or plain floats; random numbers are in [0, 1).
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from .fast import sincos
from .numerics import ONE_BELOW

ROUNDS = 8
"""Of the hash that makes more random numbers: with Mitsuba's default of 4 they are correlated (0.6 %)."""
PARTS = 2048
"""Values of the coarse part of a number that is split: the fine part of a float32 has as many again, and more."""


def direction(x: Any, y: Any, z: Any) -> Any:
    """The vector of these components, of Dr.Jit's own type for numbers like ``x``."""
    vector: Any = dr.replace_shape_t(type(x), (3, -1))  # a plain float's is float
    return (vector if dr.is_array_v(x) else dr.scalar.Array3f64)(x, y, z)


def spherical(cos: Any, u: Any) -> Any:
    """The direction at this cosine with the z axis, at an azimuth given by ``u``."""
    # Half a turn back, into the range of these functions; and forth, by the sign.
    (sin_azimuth, cos_azimuth), sin = sincos(2 * dr.pi * u - dr.pi), -dr.safe_sqrt(1 - cos * cos)
    return direction(sin * cos_azimuth, sin * sin_azimuth, cos)


def cosine_hemisphere(u: Any, v: Any) -> Any:
    """A direction above the horizon with density cos / pi.

    Squares become sectors of the disc below it, and neighbours stay neighbours: strata keep their use (Shirley and
    Chiu 1997).
    """
    x, y = 2 * u - 1, 2 * v - 1
    upright = dr.abs(x) < dr.abs(y)
    radius, across = dr.select(upright, y, x), dr.select(upright, x, y)
    turn = dr.pi / 4 * across / dr.select(radius == 0, 1, radius)
    sin, cos = dr.sincos(dr.select(upright, dr.pi / 2 - turn, turn))
    return direction(radius * cos, radius * sin, dr.safe_sqrt((1 - radius) * (1 + radius)))


def reflect(w: Any, m: Any) -> Any:
    """``w`` mirrored in the unit normal ``m``."""
    return 2 * dr.dot(w, m) * m - w


def about(n: Any, w: Any) -> Any:
    """``w``, turned from about the z axis to about the unit vector ``n``, n.z >= 0 (Duff et al. 2017)."""
    a = -dr.rcp(1 + n.z)
    b = n.x * n.y * a
    s, t = type(n)(1 + n.x * n.x * a, b, -n.x), type(n)(b, 1 + n.y * n.y * a, -n.y)
    return s * w.x + t * w.y + n * w.z


def choose(u: Any, chance: Any) -> tuple[Any, Any]:
    """(whether an event of this chance happens, what is left of ``u``, stretched to [0, 1) again)."""
    happens = u < chance
    left = dr.select(happens, u, u - chance) / dr.select(happens, chance, 1 - chance)
    return happens, dr.minimum(left, ONE_BELOW)


def split(u: Any) -> tuple[Any, Any]:
    """Two random numbers: the coarse part of ``u``, and the fine part."""
    coarse = dr.floor(u * PARTS)
    return (coarse + 0.5) / PARTS, u * PARTS - coarse


def more_numbers(u: Any, v: Any, w: Any) -> tuple[Any, Any, Any]:
    """Three more random numbers of the active variant, by hashing those at hand (Zafar et al. 2010).

    A function of the given ones, so that equal numbers give equal samples.
    """
    a, b, c = (mi.UInt32(number * 2**24) for number in (u, v, w))
    first, second = mi.sample_tea_32(mi.sample_tea_32(a, b, ROUNDS)[0], c, ROUNDS)
    third, _ = mi.sample_tea_32(second, first, ROUNDS)
    first, second, third = (mi.Float(word >> 8) * 2**-24 for word in (first, second, third))
    return first, second, third
