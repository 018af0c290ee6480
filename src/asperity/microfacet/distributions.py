"""Distributions of microfacet normals, all written by roughness: GGX, Beckmann, Phong, Gaussian and EPD; anisotropic.

D(m) is per steradian, int D(m) m_z dm = 1 over the hemisphere. At azimuth phi each is D(m) = scale D_iso(a; alpha_phi),
where a is the tilt of the normal m from the surface's,

    1 / alpha_phi^2 = cos^2 phi / alpha_u^2 + sin^2 phi / alpha_v^2,   scale = alpha_phi^2 / (alpha_u alpha_v),

so only the isotropic profiles D_iso differ (and what normalises the Gaussian). A distribution is a dataclass of its
parameters: those of a further shape come after the two roughnesses. Arguments are Dr.Jit arrays of any precision, or
plain floats.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import drjit as dr

from . import ggx
from .epd import Power
from .fast import sincos
from .numerics import TINY, heading, log1p, normalised, one_minus_exp
from .quadrature import integrate
from .sampling import direction


@dataclass
class Distribution:
    """What all have in common; a distribution defines `tilt_density` and `sample_tilt`, and may define `smith_lambda`.

    The latter two need no object if there are no parameters but the roughness: then they are static methods.
    """

    alpha_u: Any  # roughness along x
    alpha_v: Any  # along y

    largest: ClassVar[float] = math.inf
    """Largest roughness that is allowed."""

    def tilt_density(self, alpha: Any, sin: Any, cos: Any) -> Any:
        """D_iso per steradian, of roughness ``alpha``, at the tilt with this sine and cosine."""
        raise NotImplementedError

    def sample_tilt(self, alpha: Any, u: Any) -> tuple[Any, Any]:
        """(sin a, cos a) with density D_iso cos a per steradian, for ``u`` in [0, 1)."""
        raise NotImplementedError

    def tilt_node(self, alpha: Any, u: Any) -> tuple[tuple[Any, Any], Any]:
        """((sin a, cos a), weight): the tilt of a ring of normals, for the node ``u`` of a rule on [0, 1].

        A distribution whose tails are long moves the nodes towards them, which the weight makes up for.
        """
        return self.sample_tilt(alpha, u), 1

    def least_slope(self, u: Any) -> Any:
        """Least tan a / alpha_phi of the ring of `tilt_node`, roughly: that along x or y."""
        (x, _), _ = self.slopes(1, 0, u)
        (_, y), _ = self.slopes(0, 1, u)
        return dr.minimum(x / self.alpha_u, y / self.alpha_v)

    def slopes(self, cos_psi: Any, sin_psi: Any, u: Any) -> tuple[tuple[Any, Any], Any]:
        """((m_x / m_z, m_y / m_z), weight) on the ring of `tilt_node`, at an azimuth of `stretched_azimuth`."""
        cos_phi, sin_phi, alpha = self.stretched_azimuth(cos_psi, sin_psi)
        (sin, cos), weight = self.tilt_node(alpha, u)
        return (sin / cos * cos_phi, sin / cos * sin_phi), weight

    def smith_lambda(self, w: Any) -> Any:
        """Lambda(w) >= 0 of Smith's masking G1 = 1 / (1 + Lambda), for a direction above the horizon."""
        raise NotImplementedError

    def along(self, cos_azimuth: Any, sin_azimuth: Any) -> tuple[Any, Any]:
        """(alpha_phi, scale) at this azimuth."""
        if self.alpha_u is self.alpha_v:
            return self.alpha_u, 1
        square = dr.rcp(dr.square(cos_azimuth / self.alpha_u) + dr.square(sin_azimuth / self.alpha_v))
        return dr.sqrt(square), square / (self.alpha_u * self.alpha_v)

    def stretched_azimuth(self, cos_psi: Any, sin_psi: Any) -> tuple[Any, Any, Any]:
        """(cos phi, sin phi, alpha_phi), for an azimuth psi with tan phi = alpha_v / alpha_u tan psi.

        That of normals has the density scale / (2 pi) over phi; over psi it is even.
        """
        if self.alpha_u is self.alpha_v:
            return cos_psi, sin_psi, self.alpha_u
        x, y = self.alpha_u * cos_psi, self.alpha_v * sin_psi
        square = dr.square(x) + dr.square(y)
        inverse = dr.rsqrt(square)
        return x * inverse, y * inverse, square * inverse

    def sample_azimuth(self, v: Any) -> tuple[Any, Any]:
        """(cos phi, sin phi) of normals with density D cos."""
        sin, cos = sincos(2 * dr.pi * v - dr.pi)
        return self.stretched_azimuth(-cos, -sin)[:2]

    def density(self, m: Any) -> Any:
        """D(m) of a unit normal above the horizon."""
        alpha, scale = self.along(*heading(m.x, m.y))
        return scale * self.tilt_density(alpha, *ggx.inclination(m))

    def sample_density(self, m: Any) -> Any:
        """Density per steradian of `sample`: D(m) m_z, or close to it."""
        return self.density(m) * m.z

    def sample(self, u: Any, v: Any) -> Any:
        """A normal with the density `sample_density`, for ``u``, ``v`` in [0, 1)."""
        sin_psi, cos_psi = dr.sincos(2 * dr.pi * v)
        cos_phi, sin_phi, alpha = self.stretched_azimuth(cos_psi, sin_psi)
        sin, cos = self.sample_tilt(alpha, u)
        return direction(sin * cos_phi, sin * sin_phi, cos)


class GGX(Distribution):
    """D_iso = 1 / (pi alpha^2 (sin^2 a / alpha^2 + cos^2 a)^2) (Walter et al. 2007), for any alpha > 0."""

    @staticmethod
    def tilt_density(alpha: Any, sin: Any, cos: Any) -> Any:
        """D_iso at the tilt with this sine and cosine."""
        return ggx.density(dr.square(sin / alpha) + dr.square(cos), alpha, alpha)

    @staticmethod
    def sample_tilt(alpha: Any, u: Any) -> tuple[Any, Any]:
        """Slopes are alpha sqrt(u / (1 - u))."""
        return normalised(alpha * dr.sqrt(u), dr.sqrt(1 - u))

    def slopes(self, cos_psi: Any, sin_psi: Any, u: Any) -> tuple[tuple[Any, Any], Any]:
        """On an ellipse, as if 1 - u were its square: steep normals are many, and have twice as many nodes."""
        r = dr.sqrt(u * (2 - u)) / (1 - u)
        return (self.alpha_u * r * cos_psi, self.alpha_v * r * sin_psi), 2 * (1 - u)

    def density(self, m: Any) -> Any:
        """D(m), which needs no azimuth."""
        return ggx.normal_in_sphere_space(m, self.alpha_u, self.alpha_v)[1]

    def smith_lambda(self, w: Any) -> Any:
        """Lambda(w) (Walter et al. 2007)."""
        return ggx.smith_lambda(ggx.to_sphere(w, self.alpha_u, self.alpha_v))


class Beckmann(Distribution):
    """D_iso = exp(-tan^2 a / alpha^2) / (pi alpha^2 cos^4 a) (Beckmann and Spizzichino 1963), for any alpha > 0."""

    @staticmethod
    def tilt_density(alpha: Any, sin: Any, cos: Any) -> Any:
        """D_iso at the tilt with this sine and cosine."""
        square = dr.square(dr.maximum(cos, 1e-4))  # D underflows long before
        # The reciprocal before its square, or derivatives overflow.
        return dr.exp(-dr.square(sin / alpha) / square) * dr.square(dr.rcp(alpha * square)) / dr.pi

    @staticmethod
    def sample_tilt(alpha: Any, u: Any) -> tuple[Any, Any]:
        """Squares of slopes are exponential variates."""
        return normalised(alpha * dr.sqrt(-dr.log(1 - u)), 1)

    def slopes(self, cos_psi: Any, sin_psi: Any, u: Any) -> tuple[tuple[Any, Any], Any]:
        """On an ellipse, as if 1 - u were its power 3/2: the logarithm ends too fast for Gauss's rule."""
        r = dr.sqrt(-1.5 * dr.log(1 - u))
        return (self.alpha_u * r * cos_psi, self.alpha_v * r * sin_psi), 1.5 * dr.sqrt(1 - u)

    def smith_lambda(self, w: Any) -> Any:
        """(erf c - 1) / 2 + exp(-c^2) / (2 sqrt(pi) c) with 1 / c = alpha tan theta (Smith 1967; Walter et al. 2007).

        Beyond c = 4, where it is less than 3e-10, 0: float32 has lost the difference.
        """
        sin, _ = ggx.inclination(direction(self.alpha_u * w.x, self.alpha_v * w.y, w.z))
        c = dr.minimum(w.z / sin, 4)
        value = (dr.erf(c) - 1) / 2 + dr.exp(-c * c) / (2 * math.sqrt(math.pi) * c)
        return dr.select(c < 4, value, 0)


class Phong(Distribution):
    """D_iso = cos^n a / (pi alpha^2) with n = 2 / alpha^2 - 2 >= 0 (Walter et al. 2007), for alpha in (0, 1].

    Its anisotropic form is Ashikhmin and Shirley's (2000).
    """

    largest = 1.0

    @staticmethod
    def exponent(alpha: Any) -> Any:
        """The exponent n."""
        return 2 / dr.square(alpha) - 2

    @staticmethod
    def tilt_density(alpha: Any, sin: Any, cos: Any) -> Any:
        """D_iso at the tilt with this sine and cosine."""
        # Half of ln(1 - sin^2) where the logarithm of a cosine near 1 has lost its digits.
        near, far = dr.minimum(sin, 0.5), dr.maximum(cos, TINY)
        log_cos = dr.select(sin < 0.5, log1p(-near * near) / 2, dr.log(far))
        return dr.exp(Phong.exponent(alpha) * log_cos) / (dr.pi * dr.square(alpha))

    @staticmethod
    def sample_tilt(alpha: Any, u: Any) -> tuple[Any, Any]:
        """cos a = (1 - u)^(alpha^2 / 2)."""
        depth = -dr.square(alpha) * dr.log(1 - u)
        return dr.sqrt(one_minus_exp(depth)), dr.exp(-depth / 2)


@dataclass
class Gaussian(Distribution):
    """D = C exp(-a^2 / (2 alpha_phi^2)) / cos a, with alpha in radians, in (0, 1.5] (Meneveaux et al. 2018, Eq. 14).

    The anisotropic form is ours; so is C, whose formula is lost. Samples have the density of tilts with sin a = a,
    which can be inverted, cut off at the horizon.
    """

    area: Any = None  # 1 / (2 pi alpha_u alpha_v C), from the roughness

    largest = 1.5
    largest_smith: ClassVar[float] = 0.35
    """Roughness beyond which Smith's masking, of which steep facets make an infinity, depends on where they are cut."""

    def __post_init__(self) -> None:
        if self.area is None:
            angles = [(n + 0.5) * math.pi / 8 for n in range(4)]  # a quadrant in four: 2e-4 at .01 : 1
            alphas = [self.stretched_azimuth(math.cos(psi), math.sin(psi))[2] for psi in angles]
            self.area = sum(self.within(alpha) * self.mean_sinc(alpha) for alpha in alphas) / 4

    @staticmethod
    def within(alpha: Any) -> Any:
        """Share of the Gaussian's tilts, if sin a were a, that are below a right angle."""
        return one_minus_exp(dr.square(dr.rcp(alpha)) * (math.pi**2 / 8))

    @staticmethod
    def mean_sinc(alpha: Any) -> Any:
        """Mean of sin a / a of those tilts: a rational fit, good to 5e-6 up to 1.2, 5e-5 up to 1.5."""
        x = dr.square(alpha)
        above = 1 + x * (2.8171972 + x * (20.028529 + x * (60.069699 + x * 171.58494)))
        return above / (1 + x * (3.1492838 + x * (21.104714 + x * (64.760039 + x * 211.57742))))

    def tilt_density(self, alpha: Any, sin: Any, cos: Any) -> Any:
        """D_iso at the tilt with this sine and cosine; infinite at the horizon, where D cos is not."""
        a = dr.atan2(sin, cos)
        return dr.exp(-dr.square(a / alpha) / 2) / (2 * math.pi * dr.square(alpha) * self.area * dr.maximum(cos, 1e-6))

    def sample_tilt(self, alpha: Any, u: Any) -> tuple[Any, Any]:
        """Squares of tilts are exponential variates."""
        return dr.sincos(self._tilt(alpha, u))

    def _tilt(self, alpha: Any, u: Any) -> Any:
        return alpha * dr.sqrt(-2 * dr.log(1 - u * self.within(alpha)))

    def tilt_node(self, alpha: Any, u: Any) -> tuple[tuple[Any, Any], Any]:
        """The same, the weight being what sin a is of a."""
        a = self._tilt(alpha, u)
        sin, cos = dr.sincos(a)
        return (sin, cos), self.within(alpha) * sin / (dr.maximum(a, TINY) * self.area)

    def sample_density(self, m: Any) -> Any:
        """Density per steradian of `sample`."""
        alpha, scale = self.along(*heading(m.x, m.y))
        sin, cos = ggx.inclination(m)
        a = dr.atan2(sin, cos)
        profile = a / sin * dr.exp(-dr.square(a / alpha) / 2) / (2 * math.pi * dr.square(alpha))
        return scale * profile / self.within(alpha)

    def smith_lambda(self, w: Any) -> Any:
        """Lambda(w) of facets alike around the normal, up to `largest_smith`: by quadrature of (1 + Lambda) cos."""

        def ring(u: Any, captured: tuple) -> tuple[Any]:
            """Mean of <w.m> / m_z over the azimuth, where w.m / m_z = cos + b cos(psi)."""
            distribution, sin, cos = captured
            (sin_a, cos_a), weight = distribution.tilt_node(distribution.alpha_u, u)
            root = dr.sqrt(dr.maximum(dr.square(sin * sin_a / cos_a) - cos * cos, 1e-14))
            return (weight * (cos * dr.atan2(root, -cos) + root) / math.pi,)

        (seen,) = integrate(ring, 16, (self, *ggx.inclination(w)), w.z)
        return dr.maximum(seen / w.z - 1, 0)


@dataclass
class EPD(Distribution):
    """The exponential power distribution (Holzschuch and Pacanowski 2017): Beckmann's if p = 1, for any alpha > 0.

    D_iso = p exp(-(tan^2 a / alpha^2)^p) / (pi alpha^2 Gamma(1/p) cos^4 a).
    """

    power: Power  # what depends on p

    def tilt_density(self, alpha: Any, sin: Any, cos: Any) -> Any:
        """D_iso at the tilt with this sine and cosine."""
        return self.power.profile.density_of_tilts(alpha, sin, cos)

    def sample_tilt(self, alpha: Any, u: Any) -> tuple[Any, Any]:
        """Squares of slopes to the power of p are gamma variates; from a table."""
        return normalised(alpha * dr.sqrt(self.power.sample(u)), 1)

    def smith_lambda(self, w: Any) -> Any:
        """Lambda(w), from a table."""
        return self.power.smith_lambda(*ggx.inclination(direction(self.alpha_u * w.x, self.alpha_v * w.y, w.z)))


DISTRIBUTIONS: dict[str, type[Distribution]] = {"ggx": GGX, "beckmann": Beckmann, "phong": Phong}
"""By the name that a scene uses."""
