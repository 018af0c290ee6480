"""The dielectric coat of diffuse grains: how much light passes it on the way in, and again on the way out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np

from ...microfacet.fast import greater, polynomial
from ...microfacet.fresnel import Dielectric

FITTED = 1.2, 2.5
"""Relative indices between which `fit` is good to .25 % of T, or .01 of that where T is small."""
DEGREE = 7
LEAST = 1e-12
"""Least g^2, with a derivative of its root that is a number."""


@dataclass
class Coat(Dielectric):
    """A smooth interface to a dielectric of relative index ``eta``, seen from outside."""

    fitted: Sequence[Any] | None = None  # by `fit`, for an index that is the same everywhere

    def through(self, cos: Any) -> Any:
        """T = 1 - F, for the cosine of incidence in [0, 1]."""
        return transmittance(cos, self.eta) if self.fitted is None else cos * polynomial(2 * cos - 1, self.fitted)


def transmittance(cos: Any, eta: Any) -> Any:
    """1 - F of Fresnel's reflectance F, by one root and one division; 0 beyond the critical angle of an index below 1.

    With g the cosine in the dielectric times eta, F is the mean of the squares of (c - g) / (c + g) and
    (eta^2 c - g) / (eta^2 c + g), and 1 - x^2 = (1 - x) (1 + x).
    """
    eta_2 = eta * eta
    g = dr.sqrt(greater(cos * cos + (eta_2 - 1), LEAST))
    a, b = cos + g, eta_2 * cos + g
    return 2 * cos * g * (b * b + eta_2 * (a * a)) * dr.square(dr.rcp(a * b))


def fit(eta: Any) -> tuple[Any, ...]:
    """T / cos by powers of 2 cos - 1: half the cost of the exact form, for an index in `FITTED`."""
    cosines = (np.polynomial.chebyshev.chebpts1(3 * DEGREE) + 1) / 2
    slopes = [transmittance(float(cos), eta) / float(cos) for cos in cosines]
    least_squares = np.linalg.pinv(np.vander(2 * cosines - 1, DEGREE + 1, increasing=True)).tolist()
    found = tuple(sum(weight * slope for weight, slope in zip(row, slopes)) for row in least_squares)
    dr.make_opaque(found)
    return found
