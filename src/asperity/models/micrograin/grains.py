"""The statistics of Poisson-distributed half-ellipsoidal grains: how much of which normal is exposed and visible.

In sphere space (see `shadows`, which has the symbols) the grains are unit hemispheres, and a point at height h has the
normal m' with m'_z = h. ``r`` is their density there, -log(1 - tau_0) / pi, and ``tau_0`` the filling factor.
"""

from __future__ import annotations

from collections.abc import Callable
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

    def stretch(self, w: Any) -> Any:
        """|E w|."""
        return dr.sqrt(dr.square(self.beta_x * w.x) + dr.square(self.beta_y * w.y) + dr.square(w.z))

    def lift(self, w: Any) -> Any:
        """A direction kept off the horizon; those from below are meaningless then, and masked by the caller."""
        return lift(w, self.beta_x, self.beta_y)

    def visible_normal(self, w: Any, u: Any, v: Any) -> Any:
        """A unit normal of what is visible along ``w``, for ``u``, ``v`` in [0, 1): see `sample_visible_normal`."""
        m = sample_visible_normal(self.r, self.to_sphere(w), u, v)
        return dr.normalize(type(w)(self.beta_x * m.x, self.beta_y * m.y, m.z))

    def visible(self, w: Any) -> Any:
        """Visible fraction tau_i along ``w``, kept off zero for those who divide by it."""
        return dr.maximum(visible_fraction(self.r, self.to_sphere(w)), TINY)


def density(tau_0: Any) -> Any:
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

    @property
    def by_height(self) -> bool:
        """Whether it is alike all around the grain."""
        return self.cos is None

    def __call__(self, h: Any, m: Any) -> Any:
        """The share, in [0, 1], at height ``h`` and normal ``m``."""
        return h if self.by_height else (1 + m.x * self.cos + m.y * self.sin) / 2


def exposure(r: Any, h: Any, shaded: Any) -> Any:
    """Share of the plane at height ``h`` that no grain covers or shades: exp(-r (pi (1 - h^2) + shaded))."""
    return dr.exp(-r * (dr.pi * (1 - h * h) + shaded))


def visible_fraction(r: Any, w: Any) -> Any:
    """Share tau_i of what is seen from direction ``w`` (sphere space) that is grain, not base.

    1 - (1 - tau_0)^((1 + 1/cos) / 2); what Lucas 2024, Eq. 26 approximates.
    """
    _, cos = inclination(w)
    return one_minus_exp(r * (dr.pi / 2) * (1 + 1 / cos))


def sample_visible_normal(r: Any, w: Any, u: Any, v: Any) -> Any:
    """Point m' on the unit hemisphere that is visible from ``w``, distributed by visible area (all in sphere space).

    The density over normals m is tau_0 D(m) G1dist(w, h') (i.m)+ / (cos_i tau_i). Exact: first the height, then the
    azimuth about ``w``, either by inverting its distribution (docs/micrograin.md, "Derivations"). ``u``, ``v`` in
    [0, 1).
    """
    sin, cos = inclination(w)
    h = _visible_height(r, sin, cos, u)
    radius = dr.safe_sqrt((1 - h) * (1 + h))
    sin_azimuth, cos_azimuth = _visible_azimuth(sin, cos, h, radius, v)
    x, y = heading(w.x, w.y)
    return type(w)(radius * (x * cos_azimuth - y * sin_azimuth), radius * (y * cos_azimuth + x * sin_azimuth), h)


def _visible_height(r: Any, sin: Any, cos: Any, u: Any) -> Any:
    """Height h in [0, 1] above which lies the share ``u`` of the visible area: 1 - exp(-r sigma(h)) = u tau_i.

    sigma(h) = pi (1 - h^2) + sigma_s(h) is the area that a grain's part above h covers or shades on the plane.
    """
    whole = dr.pi / 2 * (1 + 1 / cos)  # sigma(0)
    sigma = -log1p(-u * one_minus_exp(r * whole)) / r
    # Above h = sin there is no shadow, and the inverse is a root; below, the unknown is alpha: h = sin cos(alpha).
    unshaded = dr.pi * cos * cos  # sigma(sin)

    def area(alpha: Any, sin_alpha: Any, cos_alpha: Any) -> tuple[Any, Any, Any]:  # and its derivatives by alpha
        h = sin * cos_alpha
        gamma = dr.atan2(sin_alpha, cos * cos_alpha + TINY)
        value = (dr.pi - gamma) * (1 - h * h) + (alpha - h * sin * sin_alpha) / cos
        # d sigma/dh = -width / cos, where width is the ring at height h as seen along w: int (w.m')+ over the azimuth.
        width = 2 * (cos * h * (dr.pi - gamma) + sin * sin_alpha)
        gamma_slope = cos / (sin_alpha * sin_alpha + cos * cos * cos_alpha * cos_alpha + TINY)
        width_slope = 2 * (sin * cos_alpha - cos * sin * sin_alpha * (dr.pi - gamma) - cos * h * gamma_slope)
        return value, sin / cos * width * sin_alpha, sin / cos * (width_slope * sin_alpha + width * cos_alpha)

    q = dr.clip((sigma - unshaded) / dr.maximum(whole - unshaded, 1e-12), 0, 1)
    # Of q, alpha is a square root at normal and a cube root at grazing incidence, where q is small.
    start = dr.pi / 2 * (cos * dr.sqrt(q) + (1 - cos) * dr.power(q + TINY, 1 / 3))
    _, cos_alpha = _invert(area, sigma, start, dr.pi / 2)
    return dr.select(sigma <= unshaded, dr.safe_sqrt(1 - sigma / dr.pi), sin * dr.maximum(cos_alpha, 0))


def _visible_azimuth(sin: Any, cos: Any, h: Any, radius: Any, v: Any) -> tuple[Any, Any]:
    """Sine and cosine of an azimuth x about ``w`` with density proportional to (w.m')+ = (a + b cos x)+.

    ``radius`` is that of the ring at height ``h``. ``v`` chooses the side, and what is left of it the point.
    """
    a, b = cos * h, sin * radius
    _, sin_alpha, gamma = silhouette(sin, cos, h)
    limit = dr.pi - gamma  # phi_q, where w.m' is zero; b sin(limit) = sin sin(alpha)
    side, v = dr.select(v < 0.5, -1.0, 1.0), dr.abs(2 * v - 1)

    def distribution(x: Any, sin_x: Any, cos_x: Any) -> tuple[Any, Any, Any]:  # and its derivatives by x
        return a * x + b * sin_x, dr.maximum(a + b * cos_x, 0), -b * sin_x

    # Where a < b the density vanishes linearly at the limit, so the distribution ends in a square root.
    start = limit * (1 - dr.sqrt(1 - v))
    sin_x, cos_x = _invert(distribution, v * (a * limit + sin * sin_alpha), start, limit)
    return side * sin_x, cos_x


def _invert(f: Callable[[Any, Any, Any], tuple[Any, Any, Any]], value: Any, x: Any, high: Any) -> tuple[Any, Any]:
    """Sine and cosine of the angle in [0, high] at which ``f`` has the ``value``, by two Halley steps from ``x``.

    ``f(x, sin x, cos x)`` gives a value and its first two derivatives.
    """
    sin, cos = dr.sincos(x)
    for _ in range(2):
        found, slope, bend = f(x, sin, cos)
        error = found - value
        step = -2 * error * slope / dr.maximum(2 * slope * slope - error * bend, TINY)
        turned = dr.clip(x + step, 0, high)
        sin, cos = _turn(sin, cos, turned - x)
        x = turned
    return sin, cos


def _turn(sin: Any, cos: Any, angle: Any) -> tuple[Any, Any]:
    """Sine and cosine of an angle advanced by less than a radian: Taylor series, good to 1e-5.

    A Halley step that long is the first of two; its error is forgiven by the next.
    """
    square = angle * angle
    s = angle * (1 - square / 6 * (1 - square / 20 * (1 - square / 42)))
    c = 1 - square / 2 * (1 - square / 12 * (1 - square / 30))
    return sin * c + cos * s, cos * c - sin * s
