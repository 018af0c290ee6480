"""The statistics of Poisson-distributed half-ellipsoidal grains: how much of which normal is exposed and visible.

In sphere space (see `shadows`) the grains are unit hemispheres of density r, and a point at height h has the normal
m' with m'_z = h. ``r`` is the density in sphere space, ``tau_0`` the filling factor.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr

from ...microfacet.ggx import inclination, lift, to_sphere
from ...microfacet.numerics import TINY, heading, keep, log1p, one_minus_exp
from .shadows import silhouette


@dataclass
class Grains:
    """The grains at a surface point; `of` computes the density. No NamedTuple: it passes through recorded loops."""

    tau_0: Any  # filling factor
    r: Any  # density in sphere space
    beta_x: Any
    beta_y: Any

    @classmethod
    def of(cls, tau_0: Any, beta_x: Any, beta_y: Any) -> Grains:
        """Grains that cover the share ``tau_0`` in [0, 1] of the base, of height over radius ``beta_x``, ``beta_y``."""
        return cls(tau_0, density(tau_0), beta_x, beta_y)

    def to_sphere(self, w: Any) -> Any:
        """A direction in sphere space."""
        return to_sphere(w, self.beta_x, self.beta_y)

    def lift(self, w: Any) -> Any:
        """A direction kept off the horizon; those from below are meaningless then, and masked by the caller."""
        return lift(w, self.beta_x, self.beta_y)

    def visible(self, w: Any) -> Any:
        """Visible fraction tau_i along ``w``, kept off zero for those who divide by it."""
        return dr.maximum(visible_fraction(self.r, self.to_sphere(w)), TINY)


def density(tau_0):
    """Grains per unit area of sphere space, r = -log(1 - tau_0) / pi (Lucas 2024, Eq. 8), for tau_0 in [0, 1].

    tau_0 = 1 would need infinitely many grains; it stands for 1 - 1e-6. 0 is next to nothing, which leaves quotients
    by r finite.
    """
    return -log1p(-keep(tau_0, FEWEST, 1 - 1e-6)) / dr.pi


FEWEST = 1e-15
"""Filling factor that stands for 0: its reciprocal's square is still a float32."""


@dataclass
class SecondColour:
    """How much of its second colour a grain has at a point: by height, or by normal if there is an azimuth."""

    cos: Any = None  # of the azimuth of the normals with the second colour
    sin: Any = None

    def __call__(self, h, m):
        """The share, in [0, 1], at height ``h`` and normal ``m``."""
        return h if self.cos is None else (1 + m.x * self.cos + m.y * self.sin) / 2


def exposure(r, h, shaded):
    """Share of the plane at height ``h`` that no grain covers or shades: exp(-r (pi (1 - h^2) + shaded))."""
    return dr.exp(-r * (dr.pi * (1 - h * h) + shaded))


def visible_fraction(r, w):
    """Share tau_i of what is seen from direction ``w`` (sphere space) that is grain, not base.

    1 - (1 - tau_0)^((1 + 1/cos) / 2); what Lucas 2024, Eq. 26 approximates.
    """
    _, cos = inclination(w)
    return one_minus_exp(r * (dr.pi / 2) * (1 + 1 / cos))


def sample_visible_normal(r, w, u, v):
    """Point m' on the unit hemisphere that is visible from ``w``, distributed by visible area (all in sphere space).

    The density over normals m is tau_0 D(m) G1dist(w, h') (i.m)+ / (cos_i tau_i). Exact: the area visible above h is
    the whole shadow sigma_full(w, h) = pi (1 - h^2) + sigma_s(w, h), whose inverse gives the height, and at a given
    height the azimuth has the density (i'.m')+. Both inversions are two Halley steps. ``u``, ``v`` in [0, 1).
    """
    sin, cos = inclination(w)
    h = _visible_height(r, sin, cos, u)
    radius = dr.safe_sqrt((1 - h) * (1 + h))
    sin_azimuth, cos_azimuth = _visible_azimuth(sin, cos, h, radius, v)
    x, y = heading(w.x, w.y)
    return type(w)(radius * (x * cos_azimuth - y * sin_azimuth), radius * (y * cos_azimuth + x * sin_azimuth), h)


def _visible_height(r, sin, cos, u):
    """Invert 1 - exp(-r sigma_full(h)) = u tau_i for the height h in [0, 1]."""
    whole = dr.pi / 2 * (1 + 1 / cos)  # sigma_full at h = 0
    visible_above = -log1p(-u * one_minus_exp(r * whole)) / r
    # Above h = sin there is no shadow; below, the unknown is the silhouette's angle: h = sin cos(alpha).
    top = dr.pi * cos * cos
    q = dr.clip((visible_above - top) / dr.maximum(whole - top, 1e-12), 0, 1)
    alpha = dr.pi / 2 * (cos * dr.sqrt(q) + (1 - cos) * dr.power(q + 1e-20, 1 / 3))
    sin_alpha, cos_alpha = dr.sincos(alpha)
    for _ in range(2):
        h = sin * cos_alpha
        gamma = dr.atan2(sin_alpha, cos * cos_alpha + 1e-20)
        f = (dr.pi - gamma) * (1 - h * h) + (alpha - h * sin * sin_alpha) / cos - visible_above
        width = 2 * (cos * h * (dr.pi - gamma) + sin * sin_alpha)  # M = -cos sigma_full'(h)
        gamma_slope = cos / (sin_alpha * sin_alpha + cos * cos * cos_alpha * cos_alpha + 1e-20)
        width_slope = 2 * (sin * cos_alpha - cos * sin * sin_alpha * (dr.pi - gamma) - cos * h * gamma_slope)
        slope, bend = sin / cos * width * sin_alpha, sin / cos * (width_slope * sin_alpha + width * cos_alpha)
        turned = dr.clip(alpha + _halley(f, slope, bend), 0, dr.pi / 2)
        sin_alpha, cos_alpha = _turn(sin_alpha, cos_alpha, turned - alpha)
        alpha = turned
    return dr.select(visible_above <= top, dr.safe_sqrt(1 - visible_above / dr.pi), sin * dr.maximum(cos_alpha, 0))


def _visible_azimuth(sin, cos, h, radius, v):
    """Sine and cosine of an azimuth x about ``w`` with density proportional to (a + b cos x)+."""
    a, b = cos * h, sin * radius
    _, sin_alpha, gamma = silhouette(sin, cos, h)
    limit = dr.pi - gamma
    side, v = dr.select(v < 0.5, -1.0, 1.0), dr.abs(2 * v - 1)
    target = v * (a * limit + sin * sin_alpha)
    # Where a < b the density vanishes linearly at the limit, so the distribution ends in a square root.
    x = limit * (1 - dr.sqrt(1 - v))
    sin_x, cos_x = dr.sincos(x)
    for _ in range(2):
        f = a * x + b * sin_x - target
        turned = dr.clip(x + _halley(f, dr.maximum(a + b * cos_x, 0), -b * sin_x), 0, limit)
        sin_x, cos_x = _turn(sin_x, cos_x, turned - x)
        x = turned
    return side * sin_x, cos_x


def _halley(f, slope, bend):
    """Halley's step to the root of a function of this value and these first two derivatives."""
    return -2 * f * slope / dr.maximum(2 * slope * slope - f * bend, 1e-20)


def _turn(sin, cos, angle):
    """Sine and cosine of an angle advanced by less than a radian: Taylor series, good to 1e-5, and normalised.

    A Halley step that long is the first of two; its error is forgiven by the next.
    """
    square = angle * angle
    s = angle * (1 - square / 6 * (1 - square / 20 * (1 - square / 42)))
    c = 1 - square / 2 * (1 - square / 12 * (1 - square / 30))
    return sin * c + cos * s, cos * c - sin * s
