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


def root(square: Any) -> Any:
    """Its root, or next to 0, without a derivative, where rounding has made it negative or 0."""
    return dr.sqrt(greater(square, NOTHING))


NOTHING = 1e-30


@dataclass
class Outline:
    """The outline of a shadow on any plane: the direction's angle with the normal, and reciprocals."""

    sin: Any
    cos: Any
    per_sin: Any
    per_cos: Any

    @classmethod
    def of(cls, w: Any) -> Outline:
        """That of the shadow along ``w``."""
        sin, cos = inclination(w)
        return cls(sin, cos, 1 / sin, 1 / cos)

    def at(self, h: Any) -> Cut:
        """On the plane at height ``h``.

        The silhouette point is on the disc, whose radius is R = sqrt(1 - h^2): R sin(gamma) = sin(alpha), and R cos(gamma) = cos cos(alpha).
        """
        cos_alpha, per_radius = lesser(h * self.per_sin, 1), dr.rsqrt(greater((1 - h) * (1 + h), SHORTEST))
        sin_alpha = root((1 - cos_alpha) * (1 + cos_alpha))
        cos_gamma, sin_gamma = lesser(self.cos * cos_alpha * per_radius, 1), sin_alpha * per_radius
        return Cut(self, h, cos_alpha, sin_alpha, cos_gamma, sin_gamma, acute_angle(cos_gamma, sin_gamma))


@dataclass
class Cut:
    """The outline of a shadow on the plane at height ``h``: its silhouette point."""

    outline: Outline
    h: Any
    cos_alpha: Any
    sin_alpha: Any
    cos_gamma: Any
    sin_gamma: Any
    gamma: Any

    def area(self) -> Any:
        """sigma_s = sigma_e - sigma_t - sigma_c."""
        alpha = acute_angle(self.cos_alpha, self.sin_alpha)
        return greater(self.sector(alpha, self.sin_alpha) - (1 - self.h * self.h) * self.gamma, 0)

    def sector(self, psi: Any, sin_psi: Any) -> Any:
        """Twice the area that the ray from the disc's centre to the outline sweeps from psi = 0: sigma_e - sigma_t.

        Arguments may be sums over several ``psi``.
        """
        # Those of the ellipse are taken in the cylinder's cross-section, which the plane stretches by 1 / cos.
        return (psi - self.h * self.outline.sin * sin_psi) * self.outline.per_cos

    def crossing(self, axis: tuple[Any, Any], cos_sum: Any, sin_sum: Any) -> tuple[Any, Any]:
        """(cos psi, sin psi) of the crossing p_+, clipped to [-alpha, alpha]."""
        sin_axis, cos_axis = axis
        sin_psi = sin_sum * cos_axis - cos_sum * sin_axis
        cos_psi = cos_sum * cos_axis + sin_sum * sin_axis
        beyond = (cos_psi < 0) | (dr.abs(sin_psi) > self.sin_alpha)  # sines tell small angles apart, cosines do not
        return (
            dr.select(beyond, self.cos_alpha, cos_psi),
            dr.select(beyond, dr.copysign(self.sin_alpha, sin_psi), sin_psi),
        )

    def own_sector(self, axis: tuple[Any, Any], cos_sum: Any, sin_sum: Any) -> Any:
        """Twice the area swept from the silhouette point on the far side, psi = -alpha, to the crossing."""
        cos_psi, sin_psi = self.crossing(axis, cos_sum, sin_sum)
        cos = self.cos_alpha * cos_psi - self.sin_alpha * sin_psi  # alpha + psi, in a single arc
        sin = greater(self.cos_alpha * sin_psi + self.sin_alpha * cos_psi, 0)
        return self.sector(angle(cos, sin), self.sin_alpha + sin_psi)


@dataclass
class Shadows:
    i: Any
    o: Any
    parts: Any = None

    def __post_init__(self) -> None:
        if self.parts is not None:  # a copy of Dr.Jit's, in a loop
            return
        i, o = self.i, self.o
        d, both = i - o, i + o
        d = d - both * (dr.dot(d, both) / dr.squared_norm(both))
        cross, K = dr.abs(i.x * d.y - i.y * d.x), dr.squared_norm(d) / 2  # |(i x o).n|, 1 - i.o
        level = root(K / (2 * i.z * o.z + K))
        cos, sin = normalised(i.x * o.x + i.y * o.y, cross + 1e-12)
        self.parts = Outline.of(i), Outline.of(o), axis(i, d, cross), axis(o, -d, cross), level, angle(cos, sin), cos, sin

    def at(self, h: Any) -> tuple[Cut, Cut]:
        return self.parts[0].at(h), self.parts[1].at(h)

    def union(self, h: Any) -> Any:
        """Area shaded along ``i`` or ``o`` on the plane at height ``h``: sigma_i + sigma_o - sigma_cap (Eq. 18)."""
        i, o = self.at(h)
        *_, axis_i, axis_o, level, between, _, _ = self.parts
        cos_sum = lesser(level * h, 1)
        sin_sum = root((1 - cos_sum) * (1 + cos_sum))
        both = i.gamma + o.gamma
        disc = both + lesser(greater(between, dr.abs(i.gamma - o.gamma)), both)
        whole = i.own_sector(axis_i, cos_sum, sin_sum) + o.own_sector(axis_o, cos_sum, sin_sum) - (1 - h * h) * disc
        return greater(0.5 * whole, 0)

    def sum(self, h: Any) -> Any:
        """Area of both shadows, their overlap counted twice: sigma_i + sigma_o (Eq. 17)."""
        i, o = self.at(h)
        return i.area() + o.area()


def axis(w: Any, d: Any, cross: Any) -> tuple[Any, Any]:
    """(sin, cos) of the angle of (B, A), see `Shadows`. 1e-12: where i = o, outlines cross at their deepest points."""
    return normalised(w.z * cross + 1e-12, w.x * d.x + w.y * d.y)
