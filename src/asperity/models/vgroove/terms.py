"""The BRDF of grooves with equal facets, term by term: `symmetric` says what these are.

Without that one's integrals over many terms, which are for roughnesses up to `ROUGHEST`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr

from ...microfacet.quadrature import accumulate
from .fresnel import Fan, Reflectance, multiples, numerators, product, waves
from .kaleidoscope import Pair
from .symmetric import POLE, bounce_limits, cook_torrance_share, numbered
from .tilts import Tilts

ROUGHEST = 2.0
"""Roughness up to which `symmetric` is as good as this."""


def by_terms(pair: Pair, cos_i: Any, tilts: Tilts, most: Any, reflectance: Reflectance | None) -> tuple[Any, Any]:
    """(f cos_o, the same of mirrors) of at most ``most`` bounces; equal if ``reflectance`` is None."""
    pole = dr.rcp(dr.maximum(pair.sin_theta, POLE))
    count, numbers = numbered(bounce_limits(pair), most)

    def term(index: Any, captured: Any) -> tuple:
        (k, odd, tau), (pole, tilts, lit, *through) = numbers(index), captured
        b = (dr.pi / 2 - tau * dr.select(odd, lit.pair.theta, lit.pair.delta)) / k
        sin, cos = dr.sincos(b)
        value = pole * cos / k * tilts.density(cos, sin) * lit(odd, tau, sin, cos)
        return (value, *(value * reflectances(k, odd, tau, sin, cos) for reflectances in through))

    single = tilts.density(pair.sin_theta, pair.cos_theta) * cook_torrance_share(pair)
    captured: tuple = (pole, tilts, Lit.of(pair))
    start: tuple = (single,)
    if reflectance is not None:
        captured = (*captured, Through.of(pair, reflectance))
        start = (single, single * reflectance.once(pair.length * pair.cos_delta))
    totals = accumulate(term, count, start, captured)
    scale = dr.rcp(4 * cos_i * pair.cos_delta)
    return scale * totals[-1], scale * totals[0]


@dataclass
class Lit:
    """g of k >= 2; without trigonometric functions of its own, and without cancellation where it is small."""

    pair: Pair
    cos_cos: Any  # cos theta cos delta
    sin_sin: Any
    sin_cos: Any  # sin theta cos delta
    cos_sin: Any

    @classmethod
    def of(cls, pair: Pair) -> Lit:
        """What does not depend on the term."""
        cos_cos, sin_sin = pair.cos_theta * pair.cos_delta, pair.sin_theta * pair.sin_delta
        return cls(pair, cos_cos, sin_sin, pair.sin_theta * pair.cos_delta, pair.cos_theta * pair.sin_delta)

    def __call__(self, odd: Any, tau: Any, sin: Any, cos: Any) -> Any:
        """g, for the sine and cosine of b."""
        pair = self.pair
        sin_p_cos_q = dr.select(odd, self.sin_cos, self.cos_sin)
        cos_p_sin_q = dr.select(odd, self.cos_sin, self.sin_cos)
        one = sin * (self.cos_cos + tau * self.sin_sin) + cos * (tau * sin_p_cos_q - cos_p_sin_q)  # sin(b + tau P - Q)
        sin_q, cos_q = dr.select(odd, pair.sin_delta, pair.sin_theta), dr.select(odd, pair.cos_delta, pair.cos_theta)
        cos_p = dr.select(odd, pair.cos_theta, pair.cos_delta)
        return dr.maximum(dr.minimum(one, 2 * cos_p * (sin * cos_q - cos * sin_q)), 0)


@dataclass
class Through:
    """The product of the reflectances, in which u = Q and w = tau P: the same for all k that are odd, or even."""

    waves: list
    cos_u: list  # pairs, for odd and for even k
    numerators: list  # for tau = 1

    @classmethod
    def of(cls, pair: Pair, reflectance: Reflectance) -> Through:
        """What does not depend on the term."""
        theta, delta = multiples(pair.sin_theta, pair.cos_theta), multiples(pair.sin_delta, pair.cos_delta)
        cos_u = [(cos_delta, cos_theta) for (_, cos_theta), (_, cos_delta) in zip(theta, delta)]
        both = list(zip(numerators(u=delta, w=theta), numerators(u=theta, w=delta)))
        return cls(waves(reflectance.logarithm, pair.length), cos_u, both)

    def __call__(self, k: Any, odd: Any, tau: Any, sin: Any, cos: Any) -> Any:
        """Product of k reflectances, for the sine and cosine of b."""
        # sin(n w) and with it those of even n change sign with tau, cos(n w) does not.
        signed = [(1 if n % 2 else tau) * dr.select(odd, *both) for n, both in enumerate(self.numerators, 1)]
        cos_u = [dr.select(odd, *both) for both in self.cos_u]
        return product(self.waves, Fan(k, odd, signed, cos_u, multiples(sin, cos)))
