"""The statistics of Poisson-distributed half-ellipsoidal grains: how much of which normal is exposed and visible.

In sphere space (see `shadows`, which has the symbols) the grains are unit hemispheres, and a point at height h has the
normal m' with m'_z = h. ``r`` is their density there, -log(1 - tau_0) / pi, and ``tau_0`` the filling factor.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr

from ...microfacet.fast import angles, greater, lesser, polynomial, reciprocals, sincos
from ...microfacet.ggx import inclination, lift, to_sphere
from ...microfacet.numerics import TINY, heading, keep, log1p, one_minus_exp


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
START = (
    (0.3538207, -3.039518, 6.668182, -4.375297),
    (4.001753, 17.71606, -75.05818, 61.26879),
    (-10.7812, -38.88744, 221.591, -197.8905),
    (14.1767, 37.90167, -258.1943, 240.5411),
    (-6.218939, -13.70831, 105.1445, -99.72404),
)
"""alpha of `_visible_height` by powers of q^(1/4) (from the first on, rows) and cos^(1/2) (columns). What counts is the
share of the visible area that one Halley step from there is off: 3e-5 at most, for all r and cosines from .001 to 1."""


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
    azimuth about ``w``, either by inverting its distribution (docs/papers/micrograin.md). ``u``, ``v`` in
    [0, 1).
    """
    sin, cos = inclination(w)
    h, radius, sin_alpha, gamma = _visible_height(r, sin, cos, u)
    sin_azimuth, cos_azimuth = _visible_azimuth(cos * h, sin * radius, sin * sin_alpha, dr.pi - gamma, v)
    x, y = heading(w.x, w.y)
    return type(w)(radius * (x * cos_azimuth - y * sin_azimuth), radius * (y * cos_azimuth + x * sin_azimuth), h)


def _visible_height(r: Any, sin: Any, cos: Any, u: Any) -> tuple[Any, Any, Any, Any]:
    """(h, R, sin alpha, gamma): the height above which lies the share ``u`` of the visible area, and the ring there.

    1 - exp(-r sigma(h)) = u tau_i, where sigma(h) = pi (1 - h^2) + sigma_s(h) is the area that a grain's part above h
    covers or shades on the plane.
    """
    # Above h = sin there is no shadow. sigma(sin) = pi cos^2, and sigma(0) = pi / 2 (1 + 1 / cos) is more by
    # pi / (2 cos) times this:
    difference = greater((1 - cos) * polynomial(cos, (1, 2, 2)), 1e-12)
    per_cos, per_r, per_difference = reciprocals(cos, r, difference)
    sigma = -log1p(-u * one_minus_exp(r * (dr.pi / 2) * (1 + per_cos))) * per_r
    q = lesser((sigma - dr.pi * cos * cos) * (2 / dr.pi) * cos * per_difference, 1)
    # Without shadow, the inverse is a root; else the unknown is alpha: h = sin cos(alpha).
    shaded, unshaded_square = q > 0, sigma * dr.inv_pi  # R^2 = 1 - h^2
    root = dr.sqrt(dr.select(shaded, q, greater(1 - unshaded_square, 0)))
    fourth = dr.sqrt(root)
    start = fourth * polynomial(fourth, [polynomial(dr.sqrt(cos), row) for row in START])

    def area(alpha: Any, sin_alpha: Any, cos_alpha: Any) -> tuple[Any, Any, Any]:  # and its derivatives by alpha
        h, x = sin * cos_alpha, cos * cos_alpha
        gamma, per_radius = _gamma(x, sin_alpha, dr.square(x) + dr.square(sin_alpha))
        lit, slope = dr.pi - gamma, cos * dr.square(per_radius)  # that of gamma
        value = lit * (1 - h * h) + (alpha - h * sin * sin_alpha) * per_cos
        # d sigma/dh = -width / cos, where width is the ring at height h as seen along w: int (w.m')+ over the azimuth.
        width = 2 * (cos * h * lit + sin * sin_alpha)
        width_slope = 2 * (sin * cos_alpha - cos * sin * sin_alpha * lit - cos * h * slope)
        tan = sin * per_cos
        return value, tan * width * sin_alpha, tan * (width_slope * sin_alpha + width * cos_alpha)

    sin_alpha, cos_alpha = _invert(area, sigma, start, dr.pi / 2, steps=1)
    sin_alpha, cos_alpha = dr.select(shaded, sin_alpha, 0), greater(cos_alpha, 0)
    square = dr.select(shaded, dr.square(cos * cos_alpha) + dr.square(sin_alpha), unshaded_square)
    gamma, per_radius = _gamma(cos * cos_alpha, sin_alpha, square)
    return dr.select(shaded, sin * cos_alpha, root), square * per_radius, sin_alpha, gamma


def _gamma(x: Any, sin_alpha: Any, square: Any) -> tuple[Any, Any]:
    """(gamma, 1 / R): R cos(gamma) = cos cos(alpha) = ``x``, R sin(gamma) = sin(alpha), R^2 = ``square``."""
    per_radius = dr.rsqrt(square + TINY)
    (gamma,) = angles((x * per_radius, sin_alpha * per_radius))
    return gamma, per_radius


def _visible_azimuth(a: Any, b: Any, b_sin_limit: Any, limit: Any, v: Any) -> tuple[Any, Any]:
    """Sine and cosine of an azimuth x about ``w`` with density proportional to (w.m')+ = (a + b cos x)+.

    It vanishes at the ``limit``, phi_q. ``v`` chooses the side, and what is left of it the point.
    """
    side, v = dr.select(v < 0.5, -1.0, 1.0), dr.abs(2 * v - 1)

    def distribution(x: Any, sin_x: Any, cos_x: Any) -> tuple[Any, Any, Any]:  # and its derivatives by x
        return a * x + b * sin_x, greater(a + b * cos_x, 0), -b * sin_x

    # Where a < b the density vanishes linearly at the limit, so the distribution ends in a square root.
    start = limit * (1 - dr.sqrt(1 - v))
    sin_x, cos_x = _invert(distribution, v * (a * limit + b_sin_limit), start, limit, steps=2)
    return side * sin_x, cos_x


def _invert(
    f: Callable[[Any, Any, Any], tuple[Any, Any, Any]], value: Any, x: Any, high: Any, steps: int
) -> tuple[Any, Any]:
    """Sine and cosine of the angle in [0, high] at which ``f`` has the ``value``, by Halley steps from ``x``.

    ``f(x, sin x, cos x)`` gives a value and its first two derivatives.
    """
    sin, cos = sincos(x)
    for _ in range(steps):
        found, slope, bend = f(x, sin, cos)
        error = found - value
        step = -2 * error * slope * dr.rcp(greater(2 * slope * slope - error * bend, TINY))
        turned = lesser(greater(x + step, 0), high)
        sin, cos = _turn(sin, cos, turned - x)
        x = turned
    return sin, cos


def _turn(sin: Any, cos: Any, angle: Any) -> tuple[Any, Any]:
    """Sine and cosine of an angle advanced by less than a radian: Taylor series, good to 1e-5.

    A Halley step that long is the first of two; its error is forgiven by the next.
    """
    square = angle * angle
    s = angle * polynomial(square, (1, -1 / 6, 1 / 120, -1 / 5040))
    c = polynomial(square, (1, -1 / 2, 1 / 24, -1 / 720))
    return sin * c + cos * s, cos * c - sin * s
