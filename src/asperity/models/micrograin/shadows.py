"""Shadows that half-ellipsoidal grains cast, and the masking-shadowing that follows (Lucas et al. 2024, Sec. 4.2).

All areas live in the *sphere space* where every grain is a unit hemisphere: directions are stretched by
E = diag(beta_x, beta_y, 1), see `to_sphere`. A shadow is cast on the plane at height ``h`` in [0, 1] above the base.
Formulas are the appendices A and B of the paper with its errata mended and without case distinctions.
Arguments are Dr.Jit arrays of any precision, or plain floats; directions have ``x``, ``y``, ``z``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr

from ...microfacet.ggx import inclination


def silhouette(sin, cos, h):
    """(cos alpha, sin alpha, gamma) of the silhouette point of a shadow on the plane at height ``h``.

    alpha is half the angle around the shadow's cylinder that is in light, cos alpha = h / sin; 0 if there is no shadow.
    gamma is the azimuth of that point about the centre of the disc that the grain cuts from the plane.
    """
    cos_alpha = dr.minimum(h / sin, 1)
    sin_alpha = dr.safe_sqrt((1 - cos_alpha) * (1 + cos_alpha))
    return cos_alpha, sin_alpha, dr.atan2(sin_alpha, cos * cos_alpha + 1e-20)


def shadow(w, h):
    """Area sigma_s of the shadow along ``w`` on the plane at height ``h`` (Lucas 2024, Appendix A)."""
    sin, cos = inclination(w)
    cos_alpha, sin_alpha, gamma = silhouette(sin, cos, h)
    alpha = dr.atan2(sin_alpha, cos_alpha + 1e-20)
    return dr.maximum((alpha - h * sin * sin_alpha) / cos - (1 - h * h) * gamma, 0)


@dataclass
class Shadows:
    """The two shadows along ``i`` and ``o``, which may overlap (Lucas 2024, Appendix B).

    Where their outlines cross, p.(i - o) = 0. In the angle psi around one shadow's cylinder, counted from its deepest
    point towards the other shadow, that is linear: B cos(psi) - A sin(psi) = (1 - i.o) h. Clipping psi at the
    silhouette points, +-alpha, yields the paper's three cases without telling them apart.
    """

    i: Any
    o: Any
    sides: Any = None  # what `_half` needs of either, from i and o

    def __post_init__(self):
        if self.sides is not None:  # a copy of Dr.Jit's, in a loop
            return
        i, o = self.i, self.o
        # The difference first: i.o and cross products lose all digits near retro-reflection. That of unit vectors is at
        # right angles to their sum; what is not is rounding, which may be all there is of the longest component.
        between, both = i - o, i + o
        between = between - both * (dr.dot(between, both) / dr.squared_norm(both))
        x, y, one_minus_cos = between.x, between.y, dr.squared_norm(between) / 2
        cross = dr.abs(i.x * y - i.y * x)
        alongs = i.x * x + i.y * y, -(o.x * x + o.y * y)
        self.sides = [self._side(w, cross, along, one_minus_cos) for w, along in zip((i, o), alongs)]

    @staticmethod
    def _side(w, cross, along, one_minus_cos):
        """What does not depend on the height: inclination, (1 - i.o) / |(A, B)|, and the angle of (A, B)."""
        sin, cos = inclination(w)
        a, b = cos * cross + 1e-12, along  # times sin
        scale = dr.rsqrt(a * a + b * b)
        return sin, cos, one_minus_cos * sin * scale, a * scale, b * scale

    def union(self, h):
        """Area shaded along ``i`` or ``o`` on the plane at height ``h``: sigma_i + sigma_o - sigma_cap (Eq. 18)."""
        return dr.maximum(sum(self._half(h, *side) for side in self.sides), 0)

    def sum(self, h):
        """Area of both shadows, their overlap counted twice: sigma_i + sigma_o (Eq. 17)."""
        return shadow(self.i, h) + shadow(self.o, h)

    @staticmethod
    def _half(h, sin, cos, level, sin_axis, cos_axis):
        """A shadow less its half of the overlap, which ends at psi = crossing - axis.

        sigma - [alpha - psi - h sin (sin alpha - sin psi)] / (2 cos) + (1 - h^2) (gamma - eta) / 2: the angles come in
        the sums alpha + psi and gamma + eta, each a single arc tangent. eta is psi as seen from the disc's centre.
        """
        cos_alpha, cos_crossing = dr.minimum(h / sin, 1), dr.minimum(level * h, 1)
        sin_alpha, sin_crossing = (dr.safe_sqrt((1 - x) * (1 + x)) for x in (cos_alpha, cos_crossing))
        sin_psi = sin_crossing * cos_axis - cos_crossing * sin_axis
        cos_psi = cos_crossing * cos_axis + sin_crossing * sin_axis
        beyond = (cos_psi < 0) | (dr.abs(sin_psi) > sin_alpha)  # sines tell small angles apart, cosines do not
        sin_psi = dr.select(beyond, dr.copysign(sin_alpha, sin_psi), sin_psi)
        cos_psi = dr.select(beyond, cos_alpha, cos_psi)
        angle = _angle_of_product(cos_alpha, sin_alpha, cos_psi, sin_psi)
        centre = _angle_of_product(cos * cos_alpha, sin_alpha, cos_psi - h * sin, cos * sin_psi)
        return ((angle - h * sin * (sin_alpha + sin_psi)) / cos - (1 - h * h) * centre) / 2


def _angle_of_product(x, y, u, v):
    """Sum of the polar angles of (x, y) and (u, v), if that is in [0, pi]."""
    return dr.atan2(dr.maximum(x * v + y * u, 0), x * u - y * v + 1e-20)
