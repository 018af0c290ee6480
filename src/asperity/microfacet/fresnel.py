"""Fresnel terms on spectra."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from .fast import polynomial, reciprocals

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


DEGREE = 3
"""Of both polynomials of a `FittedMetal`."""
NODES = (np.cos(np.pi * (np.arange(16) + 0.5) / 16) + 1) / 2
FIT = np.linalg.pinv(NODES[:, None] ** np.arange(DEGREE + 1)).tolist()
"""From a function of cos^2 at the nodes to its polynomial."""
ALLOWED = 1e-4
"""Largest error of a `FittedMetal`, of the reflectance itself."""


@dataclass
class FittedMetal(Metal):
    """A metal whose reflectance needs no root, and one division for all wavelengths; made by `fitted`.

    With s = sin^2, c = cos^2 and a + i b the root of (eta + i k)^2 - s, the two reflectances are

        R_s = ((a - cos)^2 + b^2) / ((a + cos)^2 + b^2),   R_p = R_s ((a cos - s)^2 + b^2 c) / ((a cos + s)^2 + b^2 c),

    which depend on a and a^2 + b^2 alone, two smooth functions of c: their mean is

        F = (p - q) r / ((p + q) (r + q s)),   p = a^2 + b^2 + c,   q = 2 a cos,   r = (a^2 + b^2) c + s^2.

    Of p, q and r the ``unit`` is what a^2 + b^2 is at c = 0: large metals do not overflow.
    """

    unit: Any  # its inverse
    modulus: list  # a^2 + b^2 by powers of c, spectra
    root: list  # a

    def __call__(self, cos: Any) -> Any:
        """Unpolarised reflectance at the cosine of incidence."""
        channels = zip(self.unit, zip(*self.modulus), zip(*self.root))
        above, below = zip(*(_fraction(cos, *channel) for channel in channels))
        return type(self.eta)([a * inverse for a, inverse in zip(above, reciprocals(*below))])


def fitted(metal: Metal) -> Metal:
    """As a `FittedMetal`, if its error is `ALLOWED`; or ``metal`` itself, which is the same everywhere.

    Of Mitsuba's materials that is all but AlSb, MgO, SnTe and ThF4, which are like glass at some colour. Two in three
    are good to 1e-6.
    """
    roots = [_root(metal.eta, metal.k, float(cos2)) for cos2 in NODES]
    modulus, root = _fit([a * a + b * b for a, b in roots]), _fit([a for a, _ in roots])
    unit = dr.rcp(modulus[0])
    found = FittedMetal(metal.eta, metal.k, unit, *([unit * power for power in one] for one in (modulus, root)))
    dr.make_opaque(found)  # other values need no other kernel
    cos = dr.scalar.ArrayXf64(np.linspace(1e-3, 1, 100))
    for eta, k, one, *powers in zip(*map(_channels, (found.eta, found.k, unit, *found.modulus, *found.root))):
        above, below = _fraction(cos, one, powers[: DEGREE + 1], powers[DEGREE + 1 :])
        exact = conductor(cos, eta, k)
        if not dr.all((dr.abs(above / below - exact) < ALLOWED * exact) & (above < below)):
            return metal
    return found


def _fit(values: list) -> list:
    return [sum(weight * value for weight, value in zip(row, values)) for row in FIT]


def _channels(spectrum: Any) -> list[float]:
    return np.array(spectrum, dtype=float).ravel().tolist()


def _fraction(cos: Any, unit: Any, modulus: Any, root: Any) -> tuple[Any, Any]:
    """Numerator and denominator of `FittedMetal`'s F at one wavelength."""
    cos2 = cos * cos
    sin2, square = 1 - cos2, polynomial(cos2, modulus)
    p, q, r = square + unit * cos2, 2 * cos * polynomial(cos2, root), square * cos2 + unit * (sin2 * sin2)
    return (p - q) * r, (p + q) * (r + q * sin2)


def mirror(cos: Any) -> Any:
    """Reflectance of what reflects everything."""
    return 1.0


def conductor(cos: Any, eta: Any, k: Any) -> Any:
    """Unpolarised reflectance of a conductor of index ``eta`` + i ``k`` for the cosine of incidence: in [0, 1].

    Unlike Mitsuba's, never negative by rounding, and with a derivative by k at 0, where light is totally reflected:
    of the root a + i b of (eta + i k)^2 - sin^2, the larger part is a root, the smaller one follows from a b = eta k.
    """
    cos2 = cos * cos
    sin2, (a, b) = 1 - cos2, _root(eta, k, cos2)
    b2, a_cos = b * b, a * cos
    perpendicular = (dr.square(a - cos) + b2) / (dr.square(a + cos) + b2)
    parallel = (dr.square(a_cos - sin2) + b2 * cos2) / (dr.square(a_cos + sin2) + b2 * cos2 + LEAST)
    return perpendicular * (1 + parallel) / 2


def _root(eta: Any, k: Any, cos2: Any) -> tuple[Any, Any]:
    """(a, b), the root a + i b of (eta + i k)^2 - sin^2."""
    # eta^2 - sin^2 in two ways: one keeps the digits of a small eta, the other those of a small cosine.
    real = dr.select(eta < 0.7, eta * eta - (1 - cos2), (eta - 1) * (eta + 1) + cos2) - k * k
    half = eta * k
    larger = dr.sqrt((dr.sqrt(real * real + 4 * half * half + LEAST) + dr.abs(real)) / 2)
    smaller = half / larger
    return dr.select(real > 0, larger, smaller), dr.select(real > 0, smaller, larger)
