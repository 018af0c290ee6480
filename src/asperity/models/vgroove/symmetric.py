"""The BRDF of grooves with equal facets, without loops (Lee et al. 2018, Eq. 14 to 17).

Terms are numbered by the bounces k and by the side tau, +1 if the facet met first tilts towards the half vector, else
-1. With theta and delta of the `Pair`, and (P, Q) = (theta, delta) for odd k and (delta, theta) for even k, Eq. 14 to
17 reduce to

    f cos_o = sum D(pi/2 - b) g J prod F / (4 cos_i cos delta),   b = (pi/2 - tau P) / k,
    g = max(0, min(sin(b + tau P - Q), 2 cos P sin(b - Q))),   J = cos b / (k sin theta), or 1 if k = 1,

where b is half the groove's aperture, theta_v / 2: derived in docs/papers/vgroove.md. `terms.by_terms` adds just these.

Here the terms of k <= `WRITTEN` are written out. All even k that are left, or all odd ones, are close to an integral
over k / 2. With b for the variable, dk / k = -db / b, it no longer contains k. In one groove both sides together have a
width without a kink, sin(b + P - Q) + sin(b - P - Q) = 2 cos P sin(b - Q), as g is for b < P + Q. With
H = D(pi/2 - b) cos b prod F,

    sum H g / k = int_low^top cos P sin(b - Q) H / b db + 1/2 int_top^high sin(b - P - Q) H / b db,

where light comes from one side only in the second integral, a small one. `Rest` has the ends.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr

from ...microfacet.fast import acute_sincos, greater, lesser, reciprocals
from ...microfacet.masking import cavity_visible
from .fresnel import Path, Reflectance, multiples, through, with_partner
from .kaleidoscope import Pair
from .tilts import Tilts

POLE = 1e-4
"""Least sin theta: strictly parallel facets make a pole in the mirror direction. What is cut off holds 2e-4 of the
energy of GGX with alpha 1, and less of others."""
WRITTEN = 5
"""Bounces whose terms are written out."""
RULE = ((0.11909703, 0.33039986), (0.69901746, 0.66201943))
"""(node, weight) on [low, top] for integrals of (b - Q) / b times a smooth function: good to .8 % for lines and all Q,
if that is the lower end. Gauss's has 3 %."""


def symmetric(
    pair: Pair, cos_i: Any, tilts: Tilts, most: Any, reflectance: Reflectance | None, few: int = WRITTEN + 1
) -> tuple[Any, Any]:
    """(f cos_o, the same of mirrors) of at most ``most`` bounces; equal if ``reflectance`` is None.

    ``few`` is ``most``, or `WRITTEN` + 1 where that is less.
    """
    sides = Side.both(pair)
    grooves = [sides[k % 2].term(k, tau) for k in range(2, min(few, WRITTEN) + 1) for tau in (1, -1)]
    if few > WRITTEN:
        grooves += [groove for rest in Rest.both(sides, tilts, most) for groove in rest.grooves()]
    pole, scale = reciprocals(greater(pair.sin_theta, POLE), 4 * cos_i * pair.cos_delta)
    single, *densities = tilts.densities([(pair.sin_theta, pair.cos_theta), *((g.cos, g.sin) for g in grooves)])
    single = scale * single * cook_torrance_share(pair)
    weights = [pole * scale * groove.cos * density * groove.weight for density, groove in zip(densities, grooves)]
    mirrored = single + sum(weights)
    if reflectance is None:
        return mirrored, mirrored
    light = Light.of(pair, sides, reflectance)
    value = single * light.once
    for weight, groove in zip(weights, grooves):
        value = dr.fma(weight, light.through(groove), value)
    return value, mirrored


def cook_torrance_share(pair: Pair) -> Any:
    """g of a single bounce: what the steeper of the directions, which the cavity hides more, sees of the facet h."""
    beyond = pair.cos_theta * pair.cos_delta - pair.sin_theta * pair.sin_delta  # its cosine; all are divided by l
    return cavity_visible(pair.cos_delta, beyond, pair.cos_theta)


@dataclass
class Groove:
    """A groove that leads from one direction to the other: a term, or a node of an integral over such."""

    sin: Any  # of b, half the aperture
    cos: Any
    weight: Any  # g / k, or what stands for that
    odd: int
    k: int = 0  # bounces of a term
    b: Any = None  # at a node
    inverse: Any = None  # 1 / b


@dataclass
class Side:
    """What the terms of all even k, or of all odd k, have in common: P, Q, P + Q and P - Q."""

    odd: int
    p: Any
    q: Any
    sin_p: Any
    cos_p: Any
    sin_q: Any
    cos_q: Any
    sum: tuple  # sine and cosine
    difference: tuple

    @classmethod
    def both(cls, pair: Pair) -> tuple[Side, Side]:
        """For even and for odd k."""
        theta, delta = (pair.theta, pair.sin_theta, pair.cos_theta), (pair.delta, pair.sin_delta, pair.cos_delta)
        return cls.of(0, delta, theta), cls.of(1, theta, delta)

    @classmethod
    def of(cls, odd: int, p: tuple, q: tuple) -> Side:
        """For P and Q with their sines and cosines."""
        (p, sin_p, cos_p), (q, sin_q, cos_q) = p, q
        a, b, c, d = sin_p * cos_q, cos_p * sin_q, cos_p * cos_q, sin_p * sin_q
        return cls(odd, p, q, sin_p, cos_p, sin_q, cos_q, (a + b, c - d), (a - b, c + d))

    @property
    def first(self) -> int:
        """The least k that is not written out."""
        return WRITTEN + 1 + (WRITTEN + 1 + self.odd) % 2

    def turn(self, tau: int) -> Any:
        """pi/2 - tau P: k b of all terms."""
        return dr.pi / 2 - tau * self.p

    def least(self, tau: int) -> Any:
        """What b is more than if light passes."""
        return self.q if tau > 0 else self.p + self.q

    def term(self, k: int, tau: int) -> Groove:
        """That of k bounces from the side tau."""
        sin, cos = self._quarter(tau) if k == 2 else acute_sincos(self.turn(tau) * (1 / k))
        width = self.one_sided(sin, cos)
        if tau > 0:
            sin_y, cos_y = self.difference
            width = greater(lesser(dr.fma(sin, cos_y, cos * sin_y), 2 * self.half_width(sin, cos)), 0)
        return Groove(sin, cos, width * (1 / k), self.odd, k)

    def _quarter(self, tau: int) -> tuple[Any, Any]:
        """(sin b, cos b) of b = (pi/2 - tau P) / 2, half of an angle of known sine."""
        inverse = dr.rsqrt(2 + 2 * self.sin_p)
        sin, cos = self.cos_p * inverse, (1 + self.sin_p) * inverse
        return (sin, cos) if tau > 0 else (cos, sin)

    def half_width(self, sin: Any, cos: Any) -> Any:
        """cos P sin(b - Q), or 0: half the width for both sides, for the sine and cosine of b."""
        return greater(self.cos_p * dr.fma(sin, self.cos_q, -cos * self.sin_q), 0)

    def one_sided(self, sin: Any, cos: Any) -> Any:
        """sin(b - P - Q), or 0: the width for the side -1."""
        sin_x, cos_x = self.sum
        return greater(dr.fma(sin, cos_x, -cos * sin_x), 0)


@dataclass
class Rest:
    """The terms of k = first, first + 2, ... of a `Side`, as integrals over b.

    The lower end is Q, where g ends, or the b of two more bounces than are followed, halfway. The upper ends are where
    an integral over k has to begin, for either tau, to be the sum. If terms are as k^-p that is

        k = a + p / (6 a + 3.5 p / first),   a = first - 1,

    by Euler and Maclaurin for small p, and fitted for p up to 4: to 1e-4. What terms are as near the first,

        p = -dln(H g / k) / dln k = 1 + dln H / dln b + b / (b - Q).
    """

    side: Side
    low: Any
    top: Any
    high: Any
    present: dict  # whether there is any term, by tau

    @staticmethod
    def both(sides: tuple[Side, Side], tilts: Tilts, most: Any) -> list[Rest]:
        """Of even and of odd k."""
        every = [(side, tau) for side in sides for tau in (1, -1)]
        fractions = [Rest._start(side, tau, tilts.steepness()) for side, tau in every]
        inverse = reciprocals(*(below for _, below in fractions))
        high = [above * below for (above, _), below in zip(fractions, inverse)]
        return [Rest.of(side, most, *high[2 * n : 2 * n + 2]) for n, side in enumerate(sides)]

    @staticmethod
    def _start(side: Side, tau: int, steepness: Any) -> tuple[Any, Any]:
        """Numerator and denominator of the b at which the integral begins; dln cos b / dln b is -.08 there."""
        first, turn, least = side.first, side.turn(tau), side.least(tau)
        a, bend = first - 1, 3.5 / first
        b = turn * (1 / a)
        above = greater(b - least, 1e-5)
        p = (0.92 + steepness) * above + b  # times b - Q
        p = lesser(p, 3 * a / (1 - bend / 2) * above)  # so that it begins half a bounce later at most
        below = 6 * a * above + bend * p
        return turn * below, a * below + p

    @classmethod
    def of(cls, side: Side, most: Any, top: Any, high: Any) -> Rest:
        """With the upper ends given."""
        Float, first = type(side.p), side.first
        last = 2 * dr.floor((Float(most) - first) / 2) + first
        low = greater(side.q, side.turn(1) / (last + 1))
        present = {tau: (side.turn(tau) > first * side.least(tau)) & (last >= first) for tau in (1, -1)}
        return cls(side, low, top, high, present)

    def grooves(self) -> list[Groove]:
        """The nodes of both integrals."""
        side, low = self.side, self.low
        extent = dr.select(self.present[1], greater(self.top - low, 0), 0)
        begin = greater(greater(side.least(-1), self.top), low)
        further = dr.select(self.present[-1], greater(self.high - begin, 0), 0)
        bs = [greater(low + extent * node, 1e-5) for node, _ in RULE] + [greater(begin + 0.5 * further, 1e-5)]
        found = []
        for n, (b, inverse) in enumerate(zip(bs, reciprocals(*bs))):
            sin, cos = acute_sincos(b)
            if n < len(RULE):
                weight = extent * RULE[n][1] * side.half_width(sin, cos)
            else:
                weight = 0.5 * further * side.one_sided(sin, cos)
            found.append(Groove(sin, cos, weight * inverse, side.odd, b=b, inverse=inverse))
        return found


@dataclass
class Light:
    """What is left of light after all bounces in a groove."""

    length: Any
    once: Any  # after one
    sides: tuple[Side, Side]
    paths: list[Path]
    reflectance: Reflectance

    @classmethod
    def of(cls, pair: Pair, sides: tuple[Side, Side], reflectance: Reflectance) -> Light:
        """Between two directions."""
        paths = [
            Path.of(reflectance.logarithm, pair.length, side.sum, side.difference, 2 * side.turn(1)) for side in sides
        ]
        return cls(pair.length, reflectance.once(pair.length * pair.cos_delta), sides, paths, reflectance)

    def through(self, groove: Groove) -> Any:
        """In this groove."""
        if groove.k == 0:
            return self.paths[groove.odd](groove.b, groove.inverse)
        side, pairs = self.sides[groove.odd], []
        for sin, cos in multiples(groove.sin, groove.cos)[groove.k - 2 :: -2]:
            pairs.append((self.length * side.cos_q * cos, self.length * side.sin_q * sin))
        if groove.k < 4:
            ((mean, half),) = pairs
            found = self.reflectance.few(greater(mean + half, 0)) * self.reflectance.few(greater(mean - half, 0))
        else:
            found = through(self.reflectance.logarithm, [a + b for a, b in zip(*(with_partner(*two) for two in pairs))])
        return found * self.once if groove.odd else found
