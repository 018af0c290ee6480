"""Distributions of microfacet normals, all written by roughness: GGX, Beckmann and Phong, with anisotropy.

At azimuth phi each is D(m) = scale D_iso(a; alpha_phi), where a is the tilt of the normal m from the surface's,

    1 / alpha_phi^2 = cos^2 phi / alpha_u^2 + sin^2 phi / alpha_v^2,   scale = alpha_phi^2 / (alpha_u alpha_v),

so only the isotropic profiles differ, which are the classes here. Phong's anisotropic form is Ashikhmin and Shirley's
(2000), its exponent n = 2 / alpha^2 - 2. Next to D, V-grooves need the density of a partner's tilt,

    P(a) = D_iso sin^2 a / partner(alpha) on (0, pi/2)   (Lee et al. 2018, Eq. 20),

where the scale cancels: it depends on the azimuth through alpha_phi only. `ggx` holds what Smith's theory needs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import drjit as dr

from .numerics import TINY, one_minus_exp


class GGX:
    """D_iso = 1 / (pi alpha^2 (sin^2 a / alpha^2 + cos^2 a)^2) (Walter et al. 2007), for any alpha > 0."""

    largest = math.inf

    @staticmethod
    def density(alpha, sin, cos):
        """D_iso at the tilt with this sine and cosine."""
        square = dr.square(sin / alpha) + dr.square(cos)
        return dr.rcp(dr.pi * dr.square(alpha * square))

    @staticmethod
    def partner(alpha):
        """Integral of D_iso sin^2 a over (0, pi/2)."""
        return alpha / 4

    @staticmethod
    def slope(alpha: float, share: float) -> float:
        """Slope that this share of the projected facets exceeds."""
        return alpha * math.sqrt((1 - share) / share)

    @staticmethod
    def sample(alpha, u):
        """(sin a, cos a) with density D_iso cos a per solid angle, for ``u`` in [0, 1)."""
        return _normalised(alpha * dr.sqrt(u), dr.sqrt(1 - u))

    @staticmethod
    def sample_partner(alpha, u, v, w):
        """(sin a, cos a) with density P: q is the abscissa of a point in a quarter of the disc."""
        q = dr.sqrt(u) * dr.cos(dr.pi / 2 * v)
        return _normalised(alpha * dr.safe_sqrt(1 - q * q), q)


class Beckmann:
    """D_iso = exp(-tan^2 a / alpha^2) / (pi alpha^2 cos^4 a) (Beckmann and Spizzichino 1963), for any alpha > 0."""

    largest = math.inf

    @staticmethod
    def density(alpha, sin, cos):
        """D_iso at the tilt with this sine and cosine."""
        square = dr.square(dr.maximum(cos, 1e-4))  # D underflows long before
        # The reciprocal before its square, or derivatives overflow.
        return dr.exp(-dr.square(sin / alpha) / square) * dr.square(dr.rcp(alpha * square)) / dr.pi

    @staticmethod
    def partner(alpha):
        """Integral of D_iso sin^2 a over (0, pi/2)."""
        return alpha / (4 * math.sqrt(math.pi))

    @staticmethod
    def slope(alpha: float, share: float) -> float:
        """Slope that this share of the projected facets exceeds."""
        return alpha * math.sqrt(-math.log(share))

    @staticmethod
    def sample(alpha, u):
        """(sin a, cos a) with density D_iso cos a per solid angle, for ``u`` in [0, 1)."""
        return _normalised(alpha * dr.sqrt(-dr.log(1 - u)), 1)

    @staticmethod
    def sample_partner(alpha, u, v, w):
        """(sin a, cos a) with density P: (tan a / alpha)^2 is an exponential variate plus half a squared normal one."""
        return _normalised(alpha * dr.sqrt(dr.square(dr.erfinv(v)) - dr.log(1 - u)), 1)


class Phong:
    """D_iso = cos^n a / (pi alpha^2) with n = 2 / alpha^2 - 2 >= 0 (Walter et al. 2007), for alpha in (0, 1]."""

    largest = 1.0

    @staticmethod
    def density(alpha, sin, cos):
        """D_iso at the tilt with this sine and cosine."""
        # Half the logarithm of a small sin^2 is exact where that of a cosine near 1 has lost its digits.
        log_cos = dr.select(sin < 0.5, dr.log(dr.maximum(1 - sin * sin, TINY)) / 2, dr.log(dr.maximum(cos, TINY)))
        return dr.exp(_exponent(alpha) * log_cos) / (dr.pi * dr.square(alpha))

    @staticmethod
    def partner(alpha):
        """Integral of D_iso sin^2 a over (0, pi/2), (n + 2) Gamma((n + 1) / 2) / (8 sqrt(pi) Gamma((n + 4) / 2))."""
        n = _exponent(alpha)
        return (n + 2) / (8 * math.sqrt(math.pi)) * dr.exp(dr.lgamma((n + 1) / 2) - dr.lgamma((n + 4) / 2))

    @staticmethod
    def slope(alpha: float, share: float) -> float:
        """Slope that this share of the projected facets exceeds."""
        return math.sqrt(share ** -(alpha**2) - 1)

    @staticmethod
    def sample(alpha, u):
        """(sin a, cos a) with density D_iso cos a per solid angle, for ``u`` in [0, 1)."""
        depth = -dr.square(alpha) * dr.log(1 - u)
        return dr.sqrt(one_minus_exp(depth)), dr.exp(-depth / 2)

    @staticmethod
    def sample_partner(alpha, u, v, w):
        """(sin a, cos a) with density P: cos^2 a is a beta variate times a power."""
        n = _exponent(alpha)
        radius = one_minus_exp(-2 / dr.maximum(n, 1e-4) * dr.log(1 - u))
        square = (1 - radius * dr.square(dr.cos(2 * dr.pi * v))) * dr.exp(2 / (n + 2) * dr.log(1 - w))
        return dr.safe_sqrt(1 - square), dr.sqrt(square)


DISTRIBUTIONS: dict[str, Any] = {"ggx": GGX, "beckmann": Beckmann, "phong": Phong}
"""By the name that a scene uses."""


@dataclass
class Profile:
    """A distribution along one azimuth."""

    kind: Any  # one of the classes above
    alpha: Any  # alpha_phi
    scale: Any

    @classmethod
    def along(cls, kind, cos_azimuth, sin_azimuth, alpha_u, alpha_v) -> Profile:
        """The profile of the distribution with roughness alpha_u along x and alpha_v along y."""
        square = dr.rcp(dr.square(cos_azimuth / alpha_u) + dr.square(sin_azimuth / alpha_v))
        return cls(kind, dr.sqrt(square), square / (alpha_u * alpha_v))

    def density(self, sin, cos):
        """D(m) at the tilt with this sine and cosine."""
        return self.scale * self.kind.density(self.alpha, sin, cos)


def sample_azimuth(u, alpha_u, alpha_v):
    """(cos phi, sin phi) of normals drawn from D cos, whose density is alpha_phi^2 / (2 pi alpha_u alpha_v)."""
    sin, cos = dr.sincos(2 * dr.pi * u)
    sin, cos = _normalised(alpha_v * sin, alpha_u * cos)
    return cos, sin


def _exponent(alpha):
    return 2 / dr.square(alpha) - 2


def _normalised(sin, cos):
    scale = dr.rsqrt(dr.square(sin) + dr.square(cos))
    return sin * scale, cos * scale
