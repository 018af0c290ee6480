"""Distributions of microfacet normals, all written by roughness: GGX, Beckmann and Phong, with anisotropy.

D(m) is per steradian, int D(m) m_z dm = 1 over the hemisphere. At azimuth phi each is D(m) = scale D_iso(a; alpha_phi),
where a is the tilt of the normal m from the surface's,

    1 / alpha_phi^2 = cos^2 phi / alpha_u^2 + sin^2 phi / alpha_v^2,   scale = alpha_phi^2 / (alpha_u alpha_v),

so only the isotropic profiles D_iso differ. A distribution is a dataclass of its parameters: those of a further shape
come after the two roughnesses. Arguments are Dr.Jit arrays of any precision, or plain floats.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import drjit as dr

from . import ggx
from .numerics import TINY, heading, normalised, one_minus_exp
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

    def smith_lambda(self, w: Any) -> Any:
        """Lambda(w) >= 0 of Smith's masking G1 = 1 / (1 + Lambda), for a direction above the horizon."""
        raise NotImplementedError

    def along(self, cos_azimuth: Any, sin_azimuth: Any) -> tuple[Any, Any]:
        """(alpha_phi, scale) at this azimuth."""
        square = dr.rcp(dr.square(cos_azimuth / self.alpha_u) + dr.square(sin_azimuth / self.alpha_v))
        return dr.sqrt(square), square / (self.alpha_u * self.alpha_v)

    def stretched_azimuth(self, cos_psi: Any, sin_psi: Any) -> tuple[Any, Any, Any]:
        """(cos phi, sin phi, alpha_phi), for an azimuth psi with tan phi = alpha_v / alpha_u tan psi.

        That of normals has the density scale / (2 pi) over phi; over psi it is even.
        """
        x, y = self.alpha_u * cos_psi, self.alpha_v * sin_psi
        square = dr.square(x) + dr.square(y)
        inverse = dr.rsqrt(square)
        return x * inverse, y * inverse, square * inverse

    def sample_azimuth(self, v: Any) -> tuple[Any, Any]:
        """(cos phi, sin phi) of normals with density D cos."""
        sin, cos = dr.sincos(2 * dr.pi * v)
        return self.stretched_azimuth(cos, sin)[:2]

    def density(self, m: Any) -> Any:
        """D(m) of a unit normal above the horizon."""
        alpha, scale = self.along(*heading(m.x, m.y))
        return scale * self.tilt_density(alpha, *ggx.inclination(m))

    def sample(self, u: Any, v: Any) -> Any:
        """A normal with density D(m) m_z per steradian, for ``u``, ``v`` in [0, 1)."""
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

    def tilt_node(self, alpha: Any, u: Any) -> tuple[tuple[Any, Any], Any]:
        """Twice as dense in steep normals, of which there are many."""
        return self.sample_tilt(alpha, 1 - dr.square(1 - u)), 2 * (1 - u)

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
        # Half the logarithm of a small sin^2 is exact where that of a cosine near 1 has lost its digits.
        log_cos = dr.select(sin < 0.5, dr.log(dr.maximum(1 - sin * sin, TINY)) / 2, dr.log(dr.maximum(cos, TINY)))
        return dr.exp(Phong.exponent(alpha) * log_cos) / (dr.pi * dr.square(alpha))

    @staticmethod
    def sample_tilt(alpha: Any, u: Any) -> tuple[Any, Any]:
        """cos a = (1 - u)^(alpha^2 / 2)."""
        depth = -dr.square(alpha) * dr.log(1 - u)
        return dr.sqrt(one_minus_exp(depth)), dr.exp(-depth / 2)


DISTRIBUTIONS: dict[str, type[Distribution]] = {"ggx": GGX, "beckmann": Beckmann, "phong": Phong}
"""By the name that a scene uses."""
