"""Shadows that half-ellipsoidal grains cast, and the masking-shadowing that follows (Lucas et al. 2024, Sec. 4.2).

All areas live in the *sphere space* where every grain is a unit hemisphere: directions are stretched by
E = diag(beta_x, beta_y, 1), see `to_sphere`. A shadow is cast on the plane at height ``h`` in [0, 1] above the base.
Formulas are the appendices A and B of the paper with its errata mended and without case distinctions.
Arguments are Dr.Jit arrays of any precision, or plain floats; directions have ``x``, ``y``, ``z``.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import drjit as dr

from ...microfacet.numerics import arccos

GRAZING = 1e-3
"""Smallest cosine in sphere space: shadows grow as its inverse, beyond what float32 resolves."""


class Shadow(NamedTuple):
    """The shadow that one grain casts along one direction onto the plane at height h."""

    sin: Any  # of the direction's inclination, in sphere space
    cos: Any
    alpha: Any  # half of the angle around the shadow's cylinder that is lit, 0 where there is no shadow
    sin_alpha: Any
    gamma: Any  # azimuth of the silhouette point, seen from the centre of the disc at height h
    area: Any


def to_sphere(w, beta_x, beta_y):
    """Direction ``w`` in sphere space: E w / |E w| (Lucas 2024, Sec. 4.2, "Anisotropic GAF")."""
    stretched = type(w)(beta_x * w.x, beta_y * w.y, w.z)
    return stretched * dr.rsqrt(dr.squared_norm(stretched))


def lift(w, beta_x, beta_y):
    """``w`` with z raised where it needs to be, so that its cosine in sphere space is at least `GRAZING`."""
    tangent = dr.sqrt(dr.square(beta_x * w.x) + dr.square(beta_y * w.y) + 1e-14)
    return type(w)(w.x, w.y, dr.maximum(w.z, GRAZING * tangent))


def inclination(w):
    """(sine, cosine) of the angle between ``w`` and the normal, safe at normal and at grazing incidence."""
    return dr.sqrt(w.x * w.x + w.y * w.y + 1e-14), dr.maximum(w.z, GRAZING / 2)


def silhouette(sin, cos, cos_alpha):
    """(alpha, sin alpha, gamma) of the silhouette point whose cylinder angle has cosine ``cos_alpha`` = h / sin."""
    sin_alpha = dr.safe_sqrt((1 - cos_alpha) * (1 + cos_alpha))
    alpha = dr.atan2(sin_alpha, cos_alpha + 1e-20)
    gamma = dr.atan2(sin_alpha, cos * cos_alpha + 1e-20)
    return alpha, sin_alpha, gamma


def shadow(w, h) -> Shadow:
    """Shadow along ``w`` on the plane at height ``h``, area sigma_s (Lucas 2024, Appendix A)."""
    sin, cos = inclination(w)
    cos_alpha = dr.minimum(h / sin, 1)
    alpha, sin_alpha, gamma = silhouette(sin, cos, cos_alpha)
    area = (alpha - h * sin * sin_alpha) / cos - (1 - h * h) * gamma
    return Shadow(sin, cos, alpha, sin_alpha, gamma, dr.maximum(area, 0))


def overlap(i, o, h, shadow_i: Shadow, shadow_o: Shadow):
    """Area that the shadows along ``i`` and ``o`` share, sigma_cap (Lucas 2024, Appendix B).

    Where the shadow ellipses cross, p.(i - o) = 0, which is linear in the cosine and sine of the angle psi around each
    shadow's cylinder; clipping psi at the silhouettes yields the paper's three cases.
    """
    d = i - o
    level = dr.squared_norm(d) / 2 * h
    cross = dr.abs(i.x * d.y - i.y * d.x)
    along_i, along_o = i.x * d.x + i.y * d.y, -(o.x * d.x + o.y * d.y)

    across_i, along_i = shadow_i.cos * cross / shadow_i.sin, along_i / shadow_i.sin
    across_o, along_o = shadow_o.cos * cross / shadow_o.sin, along_o / shadow_o.sin
    norm = dr.maximum(dr.sqrt(across_i * across_i + along_i * along_i + 1e-30), 1e-12)
    crossing = arccos(dr.minimum(level / norm, 1))

    cap = _beyond_crossing(shadow_i, h, crossing - dr.atan2(across_i + 1e-12, along_i))
    cap += _beyond_crossing(shadow_o, h, crossing - dr.atan2(across_o + 1e-12, along_o))
    # In exact arithmetic the minimum changes nothing; it matters when i and o differ by a few ulp in z alone.
    return dr.minimum(cap, dr.minimum(shadow_i.area, shadow_o.area))


def _beyond_crossing(shadow: Shadow, h, psi):
    """Part of a shadow between the angle ``psi`` and the silhouette nearer to the other shadow."""
    psi = dr.clip(psi, -shadow.alpha, shadow.alpha)
    sin_psi, cos_psi = dr.sincos(psi)
    eta = dr.atan2(shadow.cos * sin_psi, dr.maximum(cos_psi - h * shadow.sin, 0) + 1e-20)
    segment = (shadow.alpha - psi - h * shadow.sin * (shadow.sin_alpha - sin_psi)) / shadow.cos
    return dr.clip((segment - (1 - h * h) * (shadow.gamma - eta)) / 2, 0, shadow.area)


def union(i, o, h, shadow_i: Shadow, shadow_o: Shadow):
    """Area shaded along ``i`` or ``o``: the distant term is exp(-r union) (Lucas 2024, Eq. 18 and 19)."""
    return shadow_i.area + shadow_o.area - overlap(i, o, h, shadow_i, shadow_o)
