"""Shadows that half-ellipsoidal grains cast, and the masking-shadowing that follows (Lucas et al. 2024, Sec. 4.2).

All areas live in the *sphere space* where every grain is a unit hemisphere: directions are stretched by
E = diag(beta_x, beta_y, 1), see `to_sphere`. A shadow is cast on the plane at height ``h`` in [0, 1] above the base.
Formulas are the appendices A and B of the paper with its errata mended and without case distinctions: derived in
docs/papers/micrograin.md. Arguments are Dr.Jit arrays of any precision, or plain floats; directions have ``x``, ``y``,
``z``.

========================  ==================  ==========================================================================
paper                     here                meaning
========================  ==================  ==========================================================================
i', o'                    ``i``, ``o``        unit directions in sphere space; ``w`` is either of them
sin theta_i, cos theta_i  ``sin``, ``cos``    of the angle between ``w`` and the normal
h', cos theta_m           ``h``               height of the plane H; sin^2 theta_m = 1 - h^2
C_h                       disc                what the grain cuts from H; its radius is sin theta_m
E_h(i)                    outline             where the cylinder along ``w`` about the grain meets H: an ellipse
-                         ``psi``             angle around that cylinder, 0 at the shadow's deepest point
-                         ``eta``             the same point's azimuth about the disc's centre, 0 opposite to ``w``
q_i+, q_i-                silhouette points   where disc and outline touch: psi = +-``alpha``, eta = +-``gamma``
pi - phi_q                ``gamma``           azimuth of the silhouette point
e_x                       h sin / cos         from the disc's centre to the ellipse's
-                         ``between``         azimuth between i and o, in [0, pi]
p_+                       crossing            where the outlines of both shadows meet, psi > 0 being towards the other
sigma_s                   `shadow`            area of a shadow
sigma_s + sigma_s - cap   `Shadows.union`     area of both, their overlap sigma_cap counted once
========================  ==================  ==========================================================================
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr

from ...microfacet.fast import acute_angle, angle, greater, lesser
from ...microfacet.ggx import inclination
from ...microfacet.numerics import SHORTEST, TINY, normalised


def silhouette(sin: Any, cos: Any, h: Any) -> tuple[Any, Any, Any]:
    """(cos alpha, sin alpha, gamma) of the silhouette point of a shadow on the plane at height ``h``.

    cos alpha = h / sin; alpha and gamma are 0 if there is no shadow.
    """
    cos_alpha = dr.minimum(h / sin, 1)
    sin_alpha = dr.safe_sqrt((1 - cos_alpha) * (1 + cos_alpha))
    return cos_alpha, sin_alpha, dr.atan2(sin_alpha, cos * cos_alpha + TINY)


def shadow(w: Any, h: Any) -> Any:
    """Area sigma_s of the shadow along ``w`` on the plane at height ``h`` (Lucas 2024, Appendix A)."""
    return Outline.of(w).at(h).area()


NOTHING = 1e-30
"""Least square: its root, 1e-15, has a derivative that is a number."""


@dataclass
class Outline:
    """The outline of the shadow along a direction: what does not depend on the height of the plane.

    ``sin_axis`` and ``cos_axis`` are those of the angle of (B, A), if there is another shadow: see `Shadows`.
    """

    sin: Any  # of the direction's angle with the normal
    cos: Any
    per_sin: Any  # 1 / sin
    per_cos: Any
    sin_axis: Any = None
    cos_axis: Any = None

    @classmethod
    def of(cls, w: Any, d: Any = None, cross: Any = None) -> Outline:
        """That of the shadow along ``w``; ``d`` is w minus the other direction, ``cross`` is |(i x o).n|."""
        sin, cos = inclination(w)
        # 1e-12: where i = o, both outlines cross at their deepest points.
        axis = () if d is None else normalised(cos * cross + 1e-12, w.x * d.x + w.y * d.y)
        return cls(sin, cos, 1 / sin, 1 / cos, *axis)

    def at(self, h: Any) -> Cut:
        """Where the plane at height ``h`` cuts it.

        The silhouette point is on the disc of radius R = sqrt(1 - h^2), hence R sin(gamma) = sin(alpha) and
        R cos(gamma) = cos cos(alpha). Without a shadow both angles are 0.
        """
        cos_alpha, per_radius = lesser(h * self.per_sin, 1), dr.rsqrt(greater((1 - h) * (1 + h), SHORTEST))
        sin_alpha = _sine(cos_alpha)
        cos_gamma, sin_gamma = lesser(self.cos * cos_alpha * per_radius, 1), sin_alpha * per_radius
        return Cut(self, h, cos_alpha, sin_alpha, cos_gamma, sin_gamma, acute_angle(cos_gamma, sin_gamma))


@dataclass
class Cut:
    """The outline on the plane at height ``h``, and its silhouette point."""

    outline: Outline
    h: Any
    cos_alpha: Any
    sin_alpha: Any
    cos_gamma: Any
    sin_gamma: Any
    gamma: Any

    def area(self) -> Any:
        """Area of the whole shadow: sigma_e - sigma_t - sigma_c."""
        alpha = acute_angle(self.cos_alpha, self.sin_alpha)
        return greater(self._sector(alpha, self.sin_alpha) - (1 - self.h * self.h) * self.gamma, 0)

    def own_sector(self, cos_sum: Any, sin_sum: Any) -> Any:
        """Twice the area that the ray to the outline sweeps from psi = -alpha, on the far side, to the crossing.

        Arguments are those of psi + axis. The angles come in a sum, alpha + psi, which is a single arc.
        """
        cos_psi, sin_psi = self.crossing(cos_sum, sin_sum)
        cos = self.cos_alpha * cos_psi - self.sin_alpha * sin_psi
        sin = greater(self.cos_alpha * sin_psi + self.sin_alpha * cos_psi, 0)
        return self._sector(angle(cos, sin), self.sin_alpha + sin_psi)

    def _sector(self, psi: Any, sin_psi: Any) -> Any:
        """Twice the area that the ray from the disc's centre to the outline sweeps up to psi: sigma_e - sigma_t.

        The arguments may be sums over several ``psi``.
        """
        # Those of the ellipse are taken in the cylinder's cross-section, which the plane stretches by 1 / cos.
        return (psi - self.h * self.outline.sin * sin_psi) * self.outline.per_cos

    def crossing(self, cos_sum: Any, sin_sum: Any) -> tuple[Any, Any]:
        """(cos psi, sin psi) of the crossing p_+, clipped to [-alpha, alpha]; for the angle psi + axis."""
        sin_axis, cos_axis = self.outline.sin_axis, self.outline.cos_axis
        sin_psi = sin_sum * cos_axis - cos_sum * sin_axis
        cos_psi = cos_sum * cos_axis + sin_sum * sin_axis
        beyond = (cos_psi < 0) | (dr.abs(sin_psi) > self.sin_alpha)  # sines tell small angles apart, cosines do not
        edge = dr.copysign(self.sin_alpha, sin_psi)
        return dr.select(beyond, self.cos_alpha, cos_psi), dr.select(beyond, edge, sin_psi)


@dataclass
class Shadows:
    """The two shadows along ``i`` and ``o``, which may overlap (Lucas 2024, Appendix B).

    The ray from the disc's centre through the crossing of the outlines parts their union in two: on either side it is
    the shadow that reaches further there. Clipping the crossing to the silhouette points yields the paper's three cases
    without telling them apart.

    A point p of the plane is on both outlines where p.(i - o) = 0. In psi that is linear, B cos(psi) - A sin(psi) = K h
    with K = 1 - i.o, or cos(psi + axis) = level h, where axis is the angle of (B, A), and level the same for both:
    level^2 = K / (K + 2 i_z o_z).
    """

    i: Any
    o: Any
    outlines: tuple[Outline, Outline] | None = None  # the rest is made from i and o
    level: Any = None
    between: Any = None
    cos_between: Any = None
    sin_between: Any = None

    def __post_init__(self) -> None:
        if self.outlines is not None:  # a copy of Dr.Jit's, in a loop
            return
        # The difference first: i.o and cross products lose all digits near retro-reflection. That of unit vectors is at
        # right angles to their sum; what is not is rounding, which may be all there is of the longest component.
        i, o = self.i, self.o
        d, both = i - o, i + o
        d = d - both * (dr.dot(d, both) / dr.squared_norm(both))
        cross, K = dr.abs(i.x * d.y - i.y * d.x), dr.squared_norm(d) / 2  # |(i x o).n|, 1 - i.o
        self.outlines = Outline.of(i, d, cross), Outline.of(o, -d, cross)
        self.level = dr.sqrt(greater(K, NOTHING) / (K + 2 * i.z * o.z))
        # If either is upright, it is a right angle, as for the crossing.
        self.cos_between, self.sin_between = normalised(i.x * o.x + i.y * o.y, cross + 1e-12)
        self.between = angle(self.cos_between, self.sin_between)

    def at(self, h: Any) -> tuple[Cut, Cut]:
        """Both outlines on the plane at height ``h``."""
        assert self.outlines is not None
        return self.outlines[0].at(h), self.outlines[1].at(h)

    def union(self, h: Any) -> Any:
        """Area shaded along ``i`` or ``o`` on the plane at height ``h``: sigma_i + sigma_o - sigma_cap (Eq. 18)."""
        i, o = self.at(h)
        cos_sum = lesser(self.level * h, 1)
        sin_sum = _sine(cos_sum)
        sectors = i.own_sector(cos_sum, sin_sum) + o.own_sector(cos_sum, sin_sum)
        # Twice the arc of the disc that is in either: from the far silhouette point of one to that of the other.
        both = i.gamma + o.gamma
        arc = both + lesser(greater(self.between, dr.abs(i.gamma - o.gamma)), both)
        return greater((sectors - (1 - h * h) * arc) / 2, 0)

    def sum(self, h: Any) -> Any:
        """Area of both shadows, their overlap counted twice: sigma_i + sigma_o (Eq. 17)."""
        i, o = self.at(h)
        return i.area() + o.area()

    def first(self, h: Any) -> Any:
        """Area of the shadow along ``i`` alone."""
        return self.at(h)[0].area()


def _sine(cos: Any) -> Any:
    """The sine of an angle in [0, pi], without cancellation where its cosine is near 1."""
    return dr.sqrt(greater((1 - cos) * (1 + cos), NOTHING))
