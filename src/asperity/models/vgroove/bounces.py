"""How many bounces matter: at most ceil(pi / v) happen in a groove of aperture v (Lee et al. 2018, Eq. 4, Table 2)."""

from __future__ import annotations

import math
from bisect import bisect_left

from ...microfacet.distributions import Distribution
from ...microfacet.quadrature import gauss_legendre
from .tilts import TILTS, Tilts

LOST = 1e-3
"""Share of the ground whose grooves may need more bounces than the default of max_bounces."""
MOST = 1000
"""Bounces that are followed at most; more than the default for alpha up to 20 (GGX)."""


def needed_bounces(distribution: type[Distribution], alpha: float, lost: float = LOST) -> int:
    """Bounces that suffice in all symmetric grooves but the steepest, a share ``lost``; at most `MOST`."""
    return min(math.ceil(math.pi / (2 * math.atan(1 / TILTS[distribution].slope(alpha, lost)))), MOST)


def needed_bounces_nonsymmetric(distribution: type[Distribution], alpha: float, lost: float = LOST) -> int:
    """The same for facets of independent tilts, of which both are seldom steep; never more than of symmetric ones."""
    tilts = TILTS[distribution](alpha)
    every = range(2, needed_bounces(distribution, alpha, lost))  # fewer and fewer grooves need more and more
    return 2 + bisect_left(every, True, key=lambda n: narrow(tilts, math.pi / n) <= lost)


def narrow(tilts: Tilts, aperture: float, nodes: int = 24) -> float:
    """Share of the ground that is grooves narrower than ``aperture`` <= pi/2, of facets of independent tilts."""
    total = 0.0
    for x, weight in zip(*gauss_legendre(nodes)):
        for y, other in zip(*gauss_legendre(nodes)):
            v = aperture * x
            (sin_l, cos_l), (sin_r, cos_r) = ((math.cos(b), math.sin(b)) for b in (v * y, v * (1 - y)))
            by_ground = 2 * math.pi * tilts.density(sin_l, cos_l) * sin_l * cos_l
            total += weight * other * v * by_ground * tilts.density(sin_r, cos_r) * sin_r**2
    return aperture * total / tilts.partner()
