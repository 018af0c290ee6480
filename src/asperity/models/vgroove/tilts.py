"""Tilts of a groove's facets, in the plane across it: of one that follows D, and of a partner of independent tilt.

That of the partner has the density P(a) = D_iso sin^2 a / partner on (0, pi/2) (Lee et al. 2018, Eq. 20). It depends on
the azimuth through alpha_phi only, since the scale of D cancels. The paper's normalisations (Appendix C) are wrong.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import drjit as dr

from ...microfacet.distributions import GGX, Beckmann, Distribution, Phong
from ...microfacet.fast import angles, greater, lesser, polynomial, reciprocals
from ...microfacet.numerics import TINY, log1p, normalised, one_minus_exp

GAMMAS = 0.3125, 0.041015625, 0.0872803
"""Coefficients of w^2, w^4, w^6 in sqrt(sinh w / w), times Gamma(7/2), Gamma(11/2), Gamma(15/2) over Gamma(3/2)."""


@dataclass
class Tilts:
    """A distribution of normals along one azimuth; by default that of an isotropic one, along any."""

    alpha: Any  # alpha_phi
    scale: Any = 1

    distribution: ClassVar[Any]  # its class: of these three, tilts need no more than the roughness

    @staticmethod
    def along(distribution: Distribution, cos_azimuth: Any, sin_azimuth: Any) -> Tilts:
        """Those at this azimuth."""
        return TILTS[type(distribution)](*distribution.along(cos_azimuth, sin_azimuth))

    def density(self, sin: Any, cos: Any) -> Any:
        """D(m) at the tilt with this sine and cosine."""
        return self.scale * self.distribution.tilt_density(self.alpha, sin, cos)

    def densities(self, tilts: list[tuple[Any, Any]]) -> list:
        """D(m) at several tilts, each a sine and cosine."""
        return [self.density(*tilt) for tilt in tilts]

    def product(self, l: tuple, r: tuple) -> Any:
        """D(l) D(r) of two tilts, each a sine and cosine."""
        return self.density(*l) * self.density(*r)

    def steepness(self) -> Any:
        """dln D / dln b at the tilt pi/2 - b, of a groove of aperture 2 b, for b near .28."""
        raise NotImplementedError

    def sample(self, u: Any) -> tuple[Any, Any]:
        """(sin a, cos a) with density D_iso cos a per steradian, for ``u`` in [0, 1)."""
        return self.distribution.sample_tilt(self.alpha, u)

    def partner(self) -> Any:
        """C, the integral of D sin^2 a over (0, pi/2)."""
        return self.scale * self.isotropic_partner(self.alpha)

    @staticmethod
    def isotropic_partner(alpha: Any) -> Any:
        """The integral of D_iso sin^2 a over (0, pi/2)."""
        raise NotImplementedError

    def partners(self, sin: Any, cos: Any) -> tuple[Any, Any]:
        """Integrals of P(a) up to the tilt with this sine and cosine, and of P(a) cot a beyond."""
        raise NotImplementedError

    def sample_partner(self, u: Any, v: Any, w: Any) -> tuple[Any, Any]:
        """(sin a, cos a) with density P, for three numbers in [0, 1)."""
        raise NotImplementedError

    @staticmethod
    def slope(alpha: float, share: float) -> float:
        """Slope that this share of the projected facets exceeds."""
        raise NotImplementedError


class GGXTilts(Tilts):
    """Of GGX."""

    distribution = GGX

    def densities(self, tilts: list[tuple[Any, Any]]) -> list:
        """D = alpha^2 / (pi (sin^2 a + alpha^2 cos^2 a)^2), by a division for every four."""
        square = dr.square(self.alpha)
        scale, roots = square * dr.inv_pi * self.scale, [dr.fma(square, cos * cos, sin * sin) for sin, cos in tilts]
        inverse = [x for n in range(0, len(roots), 4) for x in reciprocals(*roots[n : n + 4])]
        return [scale * dr.square(x) for x in inverse]

    def product(self, l: tuple, r: tuple) -> Any:
        """Of this form, by one division."""
        square = dr.square(self.alpha)
        first, second = (sin * sin + square * (cos * cos) for sin, cos in (l, r))
        return dr.square(square * dr.inv_pi * self.scale * dr.rcp(first * second))

    def steepness(self) -> Any:
        """From the form above."""
        square = dr.square(self.alpha)
        return (4 - 4 * square) / (12.5 + square)

    @staticmethod
    def isotropic_partner(alpha: Any) -> Any:
        """A quarter of the roughness."""
        return alpha / 4

    def partners(self, sin: Any, cos: Any) -> tuple[Any, Any]:
        """With tan a = alpha tan t, P da is 4 / pi sin^2 t dt."""
        sin, cos = normalised(sin, self.alpha * cos)
        (t,) = angles((cos, sin))
        return 2 / math.pi * (t - sin * cos), 2 / math.pi * cos * cos / self.alpha

    def sample_partner(self, u: Any, v: Any, w: Any) -> tuple[Any, Any]:
        """With q, the abscissa of a point in a quarter of the disc, tan a is alpha sqrt(1 - q^2) / q."""
        q = dr.sqrt(u) * dr.cos(dr.pi / 2 * v)
        return normalised(self.alpha * dr.safe_sqrt(1 - q * q), q)

    @staticmethod
    def slope(alpha: float, share: float) -> float:
        """Slope that this share of the projected facets exceeds."""
        return alpha * math.sqrt((1 - share) / share)


class BeckmannTilts(Tilts):
    """Of Beckmann."""

    distribution = Beckmann

    def steepness(self) -> Any:
        """That of the exponential."""
        return 25 / dr.square(self.alpha) - 4

    @staticmethod
    def isotropic_partner(alpha: Any) -> Any:
        """An integral of a Gaussian."""
        return alpha / (4 * math.sqrt(math.pi))

    def partners(self, sin: Any, cos: Any) -> tuple[Any, Any]:
        """With z = tan a / alpha, P da is 4 / sqrt(pi) z^2 exp(-z^2) dz."""
        z = lesser(sin / greater(self.alpha * cos, 1e-12), 6)
        gauss = 2 / math.sqrt(math.pi) * dr.exp(-z * z)
        return dr.erf(z) - z * gauss, gauss / self.alpha

    def sample_partner(self, u: Any, v: Any, w: Any) -> tuple[Any, Any]:
        """(tan a / alpha)^2 is an exponential variate plus half a squared normal one."""
        return normalised(self.alpha * dr.sqrt(dr.square(dr.erfinv(v)) - dr.log(1 - u)), 1)

    @staticmethod
    def slope(alpha: float, share: float) -> float:
        """Slope that this share of the projected facets exceeds."""
        return alpha * math.sqrt(-math.log(share))


class PhongTilts(Tilts):
    """Of Phong."""

    distribution = Phong

    def steepness(self) -> Any:
        """The exponent."""
        return Phong.exponent(self.alpha)

    @staticmethod
    def isotropic_partner(alpha: Any) -> Any:
        """(n + 2) / (8 sqrt(pi)) times Gamma((n + 1) / 2) / Gamma((n + 4) / 2), by that of n + 6.

        That of a large n is a series in 1 / (n + 3/2), where the difference of two logarithms has lost its digits.
        """
        n = Phong.exponent(alpha)
        inverse = dr.rcp(n + 7.5)
        series = polynomial(dr.square(inverse), (1, *GAMMAS))
        step = (n + 4) * (n + 6) * (n + 8) / ((n + 1) * (n + 3) * (n + 5))
        return (n + 2) / math.sqrt(8 * math.pi) * step * inverse * dr.sqrt(inverse) * series

    def partners(self, sin: Any, cos: Any) -> tuple[Any, Any]:
        """With w = -ln cos a, P da is as exp(-m w) sqrt(sinh w) dw, m = n + 3/2.

        The root is sqrt(w) (1 + w^2 / 12 + w^4 / 1440 + ...), so that the integral is a sum of incomplete gamma
        functions, each an error function and powers of Z = sqrt(m w) times exp(-Z^2): for n + 2, from which that of n
        follows by a recurrence of incomplete beta functions.
        """
        n = Phong.exponent(self.alpha)
        inverse = dr.rcp(n + 3.5)
        log_cos = dr.select(sin < 0.5, log1p(-dr.square(lesser(sin, 0.5))) / 2, dr.log(greater(cos, TINY)))
        square = lesser(-(n + 3.5) * log_cos, 36)
        z, gauss = dr.sqrt(greater(square, TINY)), dr.exp(-square)  # the root of 0 has no finite derivative
        third, fifth = (gamma * dr.square(inverse) ** power for power, gamma in enumerate(GAMMAS[:2], 1))
        terms = [1 / math.gamma(power + 1.5) for power in range(1, 5)]  # of Z^(2 power + 1) exp(-Z^2)
        longer = polynomial(square, terms[:2]) * third + polynomial(square, terms) * fifth
        next_share = dr.erf(z) - z * gauss * (2 / math.sqrt(math.pi) + square * longer / (1 + third + fifth))
        beyond = dr.exp((n + 1) * log_cos) / (2 * math.pi * self.isotropic_partner(self.alpha))
        return next_share - sin * dr.square(sin) * beyond * (n + 2) / (n + 1), cos * beyond

    def sample_partner(self, u: Any, v: Any, w: Any) -> tuple[Any, Any]:
        """cos^2 a is a beta variate times a power."""
        n = Phong.exponent(self.alpha)
        radius = one_minus_exp(-2 / dr.maximum(n, 1e-4) * dr.log(1 - u))
        square = (1 - radius * dr.square(dr.cos(2 * dr.pi * v))) * dr.exp(2 / (n + 2) * dr.log(1 - w))
        return dr.safe_sqrt(1 - square), dr.sqrt(square)

    @staticmethod
    def slope(alpha: float, share: float) -> float:
        """Slope that this share of the projected facets exceeds."""
        return math.sqrt(share ** -(alpha**2) - 1)


TILTS: dict[Any, type[Tilts]] = {kind.distribution: kind for kind in (GGXTilts, BeckmannTilts, PhongTilts)}
"""By the class of the distribution."""
