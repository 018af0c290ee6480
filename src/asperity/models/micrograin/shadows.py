"""Shadows that half-ellipsoidal grains cast, and the masking-shadowing that follows (Lucas et al. 2024, Sec. 4.2).

All areas live in the *sphere space* where every grain is a unit hemisphere: directions are stretched by
E = diag(beta_x, beta_y, 1), see `to_sphere`. A shadow is cast on the plane at height ``h`` in [0, 1] above the base.
Formulas are the appendices A and B of the paper with its errata mended and without case distinctions: see "Derivations"
in docs/micrograin.md. Arguments are Dr.Jit arrays of any precision, or plain floats; directions have ``x``, ``y``,
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
p_+                       crossing            where the outlines of both shadows meet, psi > 0 being towards the other
sigma_s                   `shadow`            area of a shadow
sigma_s + sigma_s - cap   `Shadows.union`     area of both, their overlap sigma_cap counted once
========================  ==================  ==========================================================================
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr

from ...microfacet.ggx import inclination
from ...microfacet.numerics import TINY


def silhouette(sin: Any, cos: Any, h: Any) -> tuple[Any, Any, Any]:
    """(cos alpha, sin alpha, gamma) of the silhouette point of a shadow on the plane at height ``h``.

    cos alpha = h / sin; alpha and gamma are 0 if there is no shadow.
    """
    cos_alpha = dr.minimum(h / sin, 1)
    sin_alpha = _sine(cos_alpha)
    return cos_alpha, sin_alpha, dr.atan2(sin_alpha, cos * cos_alpha + TINY)


def shadow(w: Any, h: Any) -> Any:
    """Area sigma_s of the shadow along ``w`` on the plane at height ``h`` (Lucas 2024, Appendix A)."""
    sin, cos = inclination(w)
    cos_alpha, sin_alpha, gamma = silhouette(sin, cos, h)
    alpha = dr.atan2(sin_alpha, cos_alpha + TINY)
    return dr.maximum(_beyond_disc(h, sin, cos, alpha, sin_alpha, gamma), 0)


def _beyond_disc(h: Any, sin: Any, cos: Any, psi: Any, sin_psi: Any, eta: Any) -> Any:
    """Twice the area between disc and outline from the shadow's deepest point to ``psi``: sigma_e - sigma_t - sigma_c.

    The whole shadow is twice what is between 0 and alpha. The last three arguments may be sums over several ``psi``.
    """
    # Those of the ellipse are taken in the cylinder's cross-section, which the plane stretches by 1 / cos.
    ellipse_sector, triangle = psi, h * sin * sin_psi
    disc_sector = (1 - h * h) * eta
    return (ellipse_sector - triangle) / cos - disc_sector


@dataclass
class Shadows:
    """The two shadows along ``i`` and ``o``, which may overlap (Lucas 2024, Appendix B).

    The ray from the disc's centre through the crossing of the outlines parts their union in two: on either side it is
    the shadow that reaches further there. Clipping the crossing to the silhouette points yields the paper's three cases
    without telling them apart.
    """

    i: Any
    o: Any
    outlines: Any = None  # both `Outline`s, made from i and o

    def __post_init__(self) -> None:
        if self.outlines is not None:  # a copy of Dr.Jit's, in a loop
            return
        # The difference first: i.o and cross products lose all digits near retro-reflection. That of unit vectors is at
        # right angles to their sum; what is not is rounding, which may be all there is of the longest component.
        d, both = self.i - self.o, self.i + self.o
        d = d - both * (dr.dot(d, both) / dr.squared_norm(both))
        cross, K = dr.abs(self.i.x * d.y - self.i.y * d.x), dr.squared_norm(d) / 2  # |(i x o).n|, 1 - i.o
        self.outlines = Outline.of(self.i, d, cross, K), Outline.of(self.o, -d, cross, K)

    def union(self, h: Any) -> Any:
        """Area shaded along ``i`` or ``o`` on the plane at height ``h``: sigma_i + sigma_o - sigma_cap (Eq. 18)."""
        return dr.maximum(sum(outline.own_part(h) for outline in self.outlines), 0)

    def sum(self, h: Any) -> Any:
        """Area of both shadows, their overlap counted twice: sigma_i + sigma_o (Eq. 17)."""
        return shadow(self.i, h) + shadow(self.o, h)


@dataclass
class Outline:
    """The outline of one of two shadows, and where it crosses the other's: what does not depend on the height.

    A point p of the plane is on both outlines where p.(i - o) = 0. In psi that is linear, B cos(psi) - A sin(psi) = K h
    with K = 1 - i.o, or cos(psi + axis) = level h, where axis is the angle of (B, A).
    """

    sin: Any  # of the direction's angle with the normal
    cos: Any
    level: Any  # K / |(A, B)|
    sin_axis: Any
    cos_axis: Any

    @classmethod
    def of(cls, w: Any, d: Any, cross: Any, K: Any) -> Outline:
        """That of the shadow along ``w``; ``d`` is w minus the other direction, ``cross`` is |(i x o).n|."""
        sin, cos = inclination(w)
        # A and B, times sin. 1e-12: where i = o, both outlines cross at their deepest points.
        A, B = cos * cross + 1e-12, w.x * d.x + w.y * d.y
        scale = dr.rsqrt(A * A + B * B)
        return cls(sin, cos, K * sin * scale, A * scale, B * scale)

    def own_part(self, h: Any) -> Any:
        """Area of the shadow from its silhouette point on the far side, psi = -alpha, to the crossing.

        The angles come in sums, alpha + psi and gamma + eta, each of which is a single arc tangent.
        """
        sin, cos = self.sin, self.cos
        cos_alpha = dr.minimum(h / sin, 1)
        sin_alpha = _sine(cos_alpha)
        cos_psi, sin_psi = self.crossing(h, cos_alpha, sin_alpha)
        alpha_psi = _sum_of_angles(cos_alpha, sin_alpha, cos_psi, sin_psi)
        gamma_eta = _sum_of_angles(cos * cos_alpha, sin_alpha, cos_psi - h * sin, cos * sin_psi)
        return _beyond_disc(h, sin, cos, alpha_psi, sin_alpha + sin_psi, gamma_eta) / 2

    def crossing(self, h: Any, cos_alpha: Any, sin_alpha: Any) -> tuple[Any, Any]:
        """(cos psi, sin psi) of the crossing p_+, clipped to [-alpha, alpha]."""
        cos_sum = dr.minimum(self.level * h, 1)  # of psi + axis
        sin_sum = _sine(cos_sum)
        sin_psi = sin_sum * self.cos_axis - cos_sum * self.sin_axis
        cos_psi = cos_sum * self.cos_axis + sin_sum * self.sin_axis
        beyond = (cos_psi < 0) | (dr.abs(sin_psi) > sin_alpha)  # sines tell small angles apart, cosines do not
        return dr.select(beyond, cos_alpha, cos_psi), dr.select(beyond, dr.copysign(sin_alpha, sin_psi), sin_psi)


def _sine(cos: Any) -> Any:
    """The sine of an angle in [0, pi], without cancellation where its cosine is near 1."""
    return dr.safe_sqrt((1 - cos) * (1 + cos))


def _sum_of_angles(x: Any, y: Any, u: Any, v: Any) -> Any:
    """Sum of the polar angles of (x, y) and (u, v), if that is in [0, pi]."""
    return dr.atan2(dr.maximum(x * v + y * u, 0), x * u - y * v + TINY)
