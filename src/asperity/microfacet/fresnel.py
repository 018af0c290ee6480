"""Fresnel terms on spectra."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

LEAST = 1e-24
"""Keeps the root's modulus off 0, at the critical angle without absorption; it shows at cosines below 3e-6 alone."""


@dataclass
class Dielectric:
    """A smooth interface to a dielectric of relative index ``eta``."""

    eta: Any

    def __call__(self, cos: Any) -> Any:
        """Unpolarised reflectance at the cosine of incidence from outside."""
        return mi.fresnel(cos, self.eta)[0]


@dataclass
class Metal:
    """A smooth interface to a conductor of index ``eta`` + i ``k``, by wavelength."""

    eta: Any
    k: Any

    def __call__(self, cos: Any) -> Any:
        """Unpolarised reflectance at the cosine of incidence."""
        return conductor(cos, self.eta, self.k)

    def mixed(self, other: Metal, share: Any) -> Metal:
        """This metal, and ``other`` instead in a ``share`` of its index."""
        return Metal(dr.lerp(self.eta, other.eta, share), dr.lerp(self.k, other.k, share))


def mirror(cos: Any) -> Any:
    """Reflectance of what reflects everything."""
    return 1.0


def conductor(cos: Any, eta: Any, k: Any) -> Any:
    """Unpolarised reflectance of a conductor of index ``eta`` + i ``k`` for the cosine of incidence: in [0, 1].

    Unlike Mitsuba's, never negative by rounding, and with a derivative by k at 0, where light is totally reflected:
    of the root a + i b of (eta + i k)^2 - sin^2, the larger part is a root, the smaller one follows from a b = eta k.
    """
    cos2 = cos * cos
    sin2 = 1 - cos2
    # eta^2 - sin^2 in two ways: one keeps the digits of a small eta, the other those of a small cosine.
    real = dr.select(eta < 0.7, eta * eta - sin2, (eta - 1) * (eta + 1) + cos2) - k * k
    half = eta * k
    larger = dr.sqrt((dr.sqrt(real * real + 4 * half * half + LEAST) + dr.abs(real)) / 2)
    smaller = half / larger
    a, b = dr.select(real > 0, larger, smaller), dr.select(real > 0, smaller, larger)
    b2, a_cos = b * b, a * cos
    perpendicular = (dr.square(a - cos) + b2) / (dr.square(a + cos) + b2)
    parallel = (dr.square(a_cos - sin2) + b2 * cos2) / (dr.square(a_cos + sin2) + b2 * cos2 + LEAST)
    return perpendicular * (1 + parallel) / 2
