"""Fresnel terms on spectra."""

from __future__ import annotations

from collections.abc import Callable
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


def fitted(metal: Metal) -> FittedMetal | None:
    """A metal that is the same everywhere as a `FittedMetal`, if the error of that is `ALLOWED`.

    Of Mitsuba's materials that is all but AlSb, MgO, SnTe and ThF4, which are like glass at some colour. Two in three
    are good to 1e-6.
    """
    cos = dr.scalar.ArrayXf64(np.linspace(1e-3, 1, 100))
    for channel in by_channel(metal):
        _, _, unit, *powers = _coefficients(channel)
        above, below = _fraction(cos, unit, powers[: DEGREE + 1], powers[DEGREE + 1 :])
        exact = channel(cos)
        if not dr.all((dr.abs(above / below - exact) < ALLOWED * exact) & (above < below)):
            return None
    eta, k, unit, *powers = constants(_coefficients, metal)
    return FittedMetal(eta, k, unit, powers[: DEGREE + 1], powers[DEGREE + 1 :])


def by_channel(metal: Metal) -> list[Metal]:
    """A metal that is the same everywhere, colour by colour, by plain numbers."""
    eta, k = (np.array(part, dtype=float).ravel().tolist() for part in (metal.eta, metal.k))
    return list(map(Metal, eta, k))


def constants(f: Callable[[Metal], list], metal: Metal) -> list:
    """The spectra ``f(metal)`` of a metal that is the same everywhere; opaque, so that others need no other kernel.

    In double precision, without which fits lose digits. By plain numbers, since kernels for this would take a user's
    time to compile.
    """
    spectrum: Any = type(metal.eta)
    number: Any = dr.value_t(spectrum)
    opaque = (lambda value: number([value])) if dr.is_jit_v(number) else float
    return [spectrum(*map(opaque, one)) for one in zip(*map(f, by_channel(metal)))]


def _coefficients(metal: Metal) -> list:
    """The fields of a `FittedMetal` in a row."""
    roots = [_root(metal.eta, metal.k, float(cos2)) for cos2 in NODES]
    modulus, root = (
        [sum(w * value for w, value in zip(row, values)) for row in FIT]
        for values in ([a * a + b * b for a, b in roots], [a for a, _ in roots])
    )
    return [metal.eta, metal.k, *(one / dr.maximum(modulus[0], LEAST) for one in (1, *modulus, *root))]


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
