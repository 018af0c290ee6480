"""The BRDF of grooves with equal facets, in closed form (Lee et al. 2018, Eq. 14 to 17).

Terms are numbered by the bounces k and by the side tau, +1 if the facet met first tilts towards the half vector, else
-1. With theta and delta of the `Pair`, and (P, Q) = (theta, delta) for odd k and (delta, theta) for even k, Eq. 14 to
17 reduce to

    f cos_o = sum D(pi/2 - b) g J prod F / (4 cos_i cos delta),   b = (pi/2 - tau P) / k,
    g = max(0, min(sin(b + tau P - Q), 2 cos P sin(b - Q))),   J = cos b / (k sin theta), or 1 if k = 1,

where b is half the groove's aperture. g > 0 if k < (pi/2 - tau P) / (Q, or P + Q for tau = -1): few terms remain,
except near the mirror direction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr

from ...microfacet.masking import cavity_visible
from ...microfacet.quadrature import accumulate
from .fresnel import Metal, multiples, product, waves
from .kaleidoscope import Pair
from .tilts import Tilts

POLE = 1e-4
"""Least sin theta: strictly parallel facets make a pole in the mirror direction. What is cut off holds 2e-4 of the
energy of GGX with alpha 1, and less of others."""


def symmetric(pair: Pair, cos_i, tilts: Tilts, most, metal: Metal | None) -> tuple[Any, Any]:
    """(f cos_o, the same of mirrors) of at most ``most`` bounces; equal if ``metal`` is None."""
    pole = dr.rcp(dr.maximum(pair.sin_theta, POLE))
    count, numbers = numbered(limits(pair), most)

    def term(index, captured):
        (k, odd, tau), (pole, tilts, share, *through) = numbers(index), captured
        b = (dr.pi / 2 - tau * dr.select(odd, share.pair.theta, share.pair.delta)) / k
        sin, cos = dr.sincos(b)
        value = pole * cos / k * tilts.density(cos, sin) * share(odd, tau, sin, cos)
        return (value, *(value * reflectances(k, odd, tau, sin, cos) for reflectances in through))

    single = tilts.density(pair.sin_theta, pair.cos_theta) * cook_torrance_share(pair)
    start = (single,) if metal is None else (single, single * metal.once(pair.length * pair.cos_delta))
    captured = (pole, tilts, Share.of(pair), *(() if metal is None else (Through.of(pair, metal),)))
    totals = accumulate(term, count, start, captured)
    scale = dr.rcp(4 * cos_i * pair.cos_delta)
    return scale * totals[-1], scale * totals[0]


def cook_torrance_share(pair: Pair):
    """g of a single bounce: what the steeper of the directions, which the cavity hides more, sees of the facet h."""
    beyond = pair.cos_theta * pair.cos_delta - pair.sin_theta * pair.sin_delta  # its cosine; all are divided by l
    return cavity_visible(pair.cos_delta, beyond, pair.cos_theta)


def limits(pair: Pair):
    """Numbers that k stays below, for (odd, tau = 1), (odd, -1), (even, 1), (even, -1)."""
    theta, delta, both = pair.theta, pair.delta, pair.theta + pair.delta
    half = dr.pi / 2
    ranges = (half - theta, delta), (half + theta, both), (half - delta, theta), (half + delta, both)
    return [above / dr.maximum(below, 1e-6) for above, below in ranges]


def numbered(limits, most, lowest=(3, 3, 2, 2)):
    """(n, f): how many terms have k from ``lowest`` to ``most`` and below the `limits`, and f(0..n-1) = (k, odd, tau).

    Without gaps: in a loop over them no lane waits for others to find out that a term is empty.
    """
    Float, UInt = type(limits[0]), type(most)
    ends, end = [], UInt(0)
    for below, first in zip(limits, lowest):
        beyond = UInt(dr.ceil(dr.minimum(dr.detach(below), Float(most) + 1)))
        end = end + dr.select(beyond > first, (beyond + 1 - first) // 2, 0)
        ends.append(end)

    def term(index):
        later = [index >= end for end in ends[:3]]
        begin = dr.select(later[0], dr.select(later[1], dr.select(later[2], ends[2], ends[1]), ends[0]), 0)
        odd = index < ends[1]
        tau = dr.select(dr.select(odd, later[0], later[2]), Float(-1), Float(1))
        return 2 * (index - begin) + dr.select(odd, UInt(lowest[0]), UInt(lowest[2])), odd, tau

    return ends[3], term


@dataclass
class Share:
    """g of k >= 2; without trigonometric functions of its own, and without cancellation where it is small."""

    pair: Pair
    sums: tuple  # cosines and sines of theta and delta, multiplied like with like
    sines: tuple  # and one with the other

    @classmethod
    def of(cls, pair: Pair) -> Share:
        """What does not depend on the term."""
        sums = pair.cos_theta * pair.cos_delta, pair.sin_theta * pair.sin_delta
        return cls(pair, sums, (pair.sin_theta * pair.cos_delta, pair.cos_theta * pair.sin_delta))

    def __call__(self, odd, tau, sin, cos):
        """g, for the sine and cosine of b."""
        pair, (a, b) = self.pair, self.sums
        p, q = dr.select(odd, self.sines[0], self.sines[1]), dr.select(odd, self.sines[1], self.sines[0])
        lit = sin * (a + tau * b) + cos * (tau * p - q)  # sin(b + tau P - Q)
        sin_q, cos_q = dr.select(odd, pair.sin_delta, pair.sin_theta), dr.select(odd, pair.cos_delta, pair.cos_theta)
        cos_p = dr.select(odd, pair.cos_theta, pair.cos_delta)
        return dr.maximum(dr.minimum(lit, 2 * cos_p * (sin * cos_q - cos * sin_q)), 0)


@dataclass
class Through:
    """The product of the reflectances: u = Q and w = tau P, the same for all k of a parity."""

    waves: list
    tops: list
    bends: list

    @classmethod
    def of(cls, pair: Pair, metal: Metal) -> Through:
        """What does not depend on the term; pairs are for odd and even k."""
        theta, delta = multiples(pair.sin_theta, pair.cos_theta), multiples(pair.sin_delta, pair.cos_delta)
        tops = [(d, t) for (_, t), (_, d) in zip(theta, delta)]
        bends = [
            (d * t, d * t) if n % 2 else (-d * z, -t * y) for n, ((z, t), (y, d)) in enumerate(zip(theta, delta), 1)
        ]
        return cls(waves(metal.logarithm, pair.length), tops, bends)

    def __call__(self, k, odd, tau, sin, cos):
        """Product of k reflectances, for the sine and cosine of b."""
        bends = [(1 if n % 2 else tau) * dr.select(odd, *bend) for n, bend in enumerate(self.bends, 1)]
        tops = [dr.select(odd, *top) for top in self.tops]
        return product(self.waves, k, odd, bends, tops, multiples(sin, cos))
