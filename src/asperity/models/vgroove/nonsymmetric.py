"""The BRDF of grooves whose facets have independent tilts, by fixed quadrature (Lee et al. 2018, Eq. 18 to 23).

Terms are numbered as in `symmetric`, and with its P, Q and tau the light comes at the angle x = tau P + Q and goes at
y = tau P - Q. Given the partner's tilt r, the tilt l of the facet that is met first follows from the number of bounces:

    l = (2 tau P + (k - 1) (pi - r)) / (k + 1) for odd k,   l = pi - v - r, v = (pi - 2 tau P) / k for even k,
    f cos_o = sum int D(l) sin l D(r) sin r g' J prod F dr / (4 C cos_i cos delta),   C = int D sin^2 r dr,
    J = 1 / sin theta for k = 1, 2 / ((k + 1) sin theta) for odd, 2 / (k sin theta) for even k,

g' = g sin l sin r being the width of the rays that leave after k bounces. C is wrong in the paper's appendix C.

    Lee et al. 2018              here
    theta_l, theta_r             -l, r
    P(theta_r)                   D(r) sin^2 r / C, the density of `Tilts.sample_partner`
    ds_l / do                    J sin l / (4 l_pair cos delta), l_pair the ``length`` of the `Pair`
    f_a, f_b, f_k                `_reaches`: f_1, max(f_0, 0), and f_k by the reversed path
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import drjit as dr

from ...microfacet.distributions import GGX, Beckmann, Phong
from ...microfacet.fast import angles, greater, lesser, reciprocals, sincos
from ...microfacet.numerics import clamp
from ...microfacet.quadrature import accumulate, integrate
from .fresnel import Fan, Reflectance, multiples, numerators, product, waves
from .kaleidoscope import Pair
from .symmetric import POLE
from .terms import numbered
from .tilts import Tilts

NODES = {GGX: (4, 5), Beckmann: (4, 8), Phong: (4, 8)}
"""For k = 2, in each piece between kinks, and for all others, whose share is small.

A density has to be exact to .05 % or so: what its integral misses looks like lost samples. Tails of GGX are smoother.
"""


def nonsymmetric(pair: Pair, cos_i: Any, tilts: Tilts, most: Any, reflectance: Reflectance | None) -> tuple[Any, Any]:
    """(f cos_o, the same of mirrors) of at most ``most`` bounces; equal if ``reflectance`` is None."""
    once = 1 if reflectance is None else reflectance.once(pair.length * pair.cos_delta)
    colour, mirrored = several(pair, tilts, most, reflectance, NODES[tilts.distribution])
    pole, scale = reciprocals(greater(pair.sin_theta, POLE), 4 * cos_i * pair.cos_delta)
    single, pole = scale * single_bounce(pair, tilts), pole * scale / tilts.partner()
    return single * once + pole * colour, single + pole * mirrored


def single_bounce(pair: Pair, tilts: Tilts) -> Any:
    """4 cos_i cos delta times f cos_o of mirrors after one bounce, from a facet whose normal is the half vector.

    What x, the steeper direction, sees of it is cos delta; or, if the partner's tilt r is more than pi/2 - x, which
    leaves it partly in shadow, cos x sin(theta + r) / sin r. Its mean over partners is closed.
    """
    sin_x = pair.sin_theta * pair.cos_delta + pair.cos_theta * pair.sin_delta
    cos_x = greater(pair.cos_theta * pair.cos_delta - pair.sin_theta * pair.sin_delta, 0)
    flatter, steeper = tilts.partners(cos_x, sin_x)
    seen = flatter * pair.cos_delta + cos_x * ((1 - flatter) * pair.cos_theta + steeper * pair.sin_theta)
    return tilts.density(pair.sin_theta, pair.cos_theta) * seen


def several(
    pair: Pair,
    tilts: Tilts,
    most: Any,
    reflectance: Reflectance | None,
    nodes: tuple[int, int],
    each: bool = False,
) -> tuple[Any, Any]:
    """4 cos_i cos delta sin theta C times (f cos_o, the same of mirrors) of two bounces and more, by these `NODES`.

    The product of reflectances varies little over the grooves: it is that at their mean r or, for two bounces, at the
    two nodes of the Gauss rule for their distribution; or ``each`` groove has its own, at ten times the cost.
    """
    e = [] if reflectance is None else waves(reflectance.logarithm, pair.length)
    zero, limits = dr.zeros(type(pair.theta)), bounce_limits_nonsymmetric(pair)
    totals: tuple = (zero,) if reflectance is None else (zero, zero * reflectance.logarithm[0])

    def with_bounces(totals: tuple, counted: tuple, nodes: int, double: bool) -> tuple:
        count, numbers = counted

        def term(index: Any, captured: Any) -> tuple:
            (k, odd, tau), (pair, tilts, e) = numbers(index), captured
            p, q = dr.select(odd, pair.theta, pair.delta), dr.select(odd, pair.delta, pair.theta)
            way, scale = Way(k, odd, tau * p, q), 2 / type(p)(dr.select(odd, k + 1, k))
            total, first, second, *reflected = moments(way, tilts, nodes, double, e if each else [])
            if not e or each:
                return (scale * total, *(scale * one for one in reflected))
            mean, square = (moment / dr.select(total > 1e-15, total, 1) for moment in (first, second))
            if double:
                spread = dr.sqrt(greater(square - mean * mean, 1e-12))
                through = (way.reflected(mean - spread, e) + way.reflected(mean + spread, e)) / 2
            else:
                through = way.reflected(mean, e)
            return scale * total, scale * total * through

        return accumulate(term, count, totals, (pair, tilts, e))

    double, multiple = nodes
    totals = with_bounces(totals, numbered(limits, dr.minimum(most, type(most)(2))), double, True)
    totals = with_bounces(totals, numbered(limits, most, first_even=4), multiple, False)
    return totals[-1], totals[0]


def bounce_limits_nonsymmetric(pair: Pair) -> tuple:
    """Numbers that k stays below, as in `symmetric`: where the intervals of integration become empty.

    Odd k have a second limit, since both directions meet the facet of tilt l: with the `_reaches` of both, f_0 < f_k is
    cos y cot l + cos x cot r > sin x - sin y. The cotangents are tangents of two angles that add up to the aperture v,
    so that their sum is at most tan v, and

        tan v > 2 cos P sin Q / max(cos x, cos y) = 2 cos P sin Q / cos(P - Q),

    while l < pi/2 leaves v = (2 l - 2 tau P) / (k - 1) < (pi - 2 tau P) / (k - 1).
    """
    theta, delta = pair.theta, pair.delta
    nearer = pair.cos_theta * pair.cos_delta + pair.sin_theta * pair.sin_delta
    least = dr.maximum(dr.atan2(2 * pair.sin_delta * pair.cos_theta, nearer), 1e-6)

    def odd(tau: int) -> Any:
        above = dr.pi - 2 * tau * theta
        return dr.minimum(above / dr.maximum(delta - tau * theta, 1e-6) - 1, above / least + 1)

    def even(tau: int) -> Any:
        below = theta if tau > 0 else theta + delta + dr.maximum(delta - theta, 0)
        return (dr.pi - 2 * tau * delta) / dr.maximum(below, 1e-6)

    return odd(1), odd(-1), even(1), even(-1)


@dataclass
class Way:
    """How light goes from x to y in k >= 2 bounces, through all grooves that lead there, one for each tilt r."""

    k: Any
    odd: Any
    p: Any  # tau P
    q: Any

    def first_tilt(self, r: Any) -> Any:
        """The tilt l."""
        k, p = self.k, self.p
        return dr.select(self.odd, (2 * p + (k - 1) * (dr.pi - r)) / (k + 1), dr.pi - (dr.pi - 2 * p) / k - r)

    def interval(self) -> tuple[Any, Any]:
        """(least r, length): where both tilts are in (0, pi/2) and, as far as that is simple, the width is not 0.

        For odd k that bounds l, which falls with r: l < pi/2 + y, else f_k < 0. For even k, l < pi/2 + x, else f_1 < 0;
        r < pi/2 + y, else f_k < 0; and r < pi/2 - Q, else f_0 > f_k.
        """
        k, p, q, up = self.k, self.p, self.q, dr.pi / 2
        x, y = p + q, p - q
        v = (dr.pi - 2 * p) / k
        low = dr.select(
            self.odd, dr.pi - ((k + 1) * (up + dr.minimum(y, 0)) - 2 * p) / (k - 1), up - v - dr.minimum(x, 0)
        )
        high = dr.select(self.odd, dr.pi + 2 * p / (k - 1), dr.minimum(dr.pi - v, up - q + dr.minimum(p, 0)))
        low, high = dr.maximum(low, 0), dr.minimum(high, up)
        return low, dr.maximum(high - low, 0)

    def kinks(self, low: Any, high: Any) -> tuple:
        """The tilts r of k = 2 at which g' has a kink, in order, from ``low`` to ``high``.

        With p = tau P, l + r = pi/2 + p and s = r - l + Q, its `_reaches` are

            2 f_1 = cos Q + sin(p + s),   2 f_0 = sin(p + s) - cos(2 p + Q),
            2 f_2 = cos Q + sin(p - s),   2 f_3 = sin(p - s) - cos(2 p - Q),

        and g' = min(f_1, f_2) - max(f_0, f_3, 0) has a kink at s = 0, where f_1 = f_2. The others are where f_3 falls
        to 0 and where f_0 rises from 0; but where f_0 = f_3, which is sin s = -2 sin p sin Q, if it rises first.
        """
        p, q, up = self.p, self.q, dr.pi / 2
        middle = (up + p - q) / 2  # r at s = 0; at any s, r = middle + s/2
        f_3_ends, f_0_begins = 2 * p - q, up - p - q  # cos(y + l) = 0, cos(x + r) = 0
        equal = middle + dr.asin(dr.clip(-2 * dr.sin(p) * dr.sin(q), -1, 1)) / 2
        overlap = f_3_ends > f_0_begins
        a, b = dr.select(overlap, equal, f_3_ends), dr.select(overlap, equal, f_0_begins)  # a <= b
        in_order = dr.minimum(middle, a), dr.maximum(a, dr.minimum(middle, b)), dr.maximum(middle, b)
        return low, *(dr.clip(kink, low, high) for kink in in_order), high

    def reflected(self, r: Any, e: list) -> Any:
        """Product of the reflectances in the groove with this r: u = Q and w = tau P, shifted by half r - l."""
        l = self.first_tilt(r)
        turn = (r - l) / 2
        u = multiples(*sincos(self.q + dr.select(self.odd, 0, turn)))
        w = multiples(*sincos(self.p + dr.select(self.odd, turn, 0)))
        b = multiples(*sincos((dr.pi - l - r) / 2))
        return product(e, Fan(self.k, self.odd, numerators(u, w), [cos for _, cos in u], b))


@dataclass
class Width:
    """g' = min(f_1, f_k) - max(f_0, f_(k+1), 0), the width of the rays that leave a groove after k bounces.

    The reason is that of `kaleidoscope.leaving_share`.
    """

    odd: Any
    x: tuple  # sine and cosine
    y: tuple

    @classmethod
    def of(cls, way: Way) -> Width:
        """That of a way."""
        return cls(way.odd, sincos(way.p + way.q), sincos(way.p - way.q))

    def __call__(self, l: tuple, r: tuple) -> Any:
        """For (sin l, cos l) and (sin r, cos r)."""
        last, other = (tuple(dr.select(self.odd, a, b) for a, b in zip(*two)) for two in ((l, r), (r, l)))
        f_0, f_1 = _reaches(self.x, l, r)
        f_after, f_k = _reaches(self.y, last, other)
        return dr.maximum(dr.minimum(f_1, f_k) - dr.maximum(dr.maximum(f_0, f_after), 0), 0)


def moments(way: Way, tilts: Tilts, nodes: int, double: bool, e: list) -> tuple:
    """Integrals of D(l) sin l D(r) sin r g' {1, r, r^2} over r and, given `waves`, times the product of reflectances.

    ``double`` tells that k = 2.
    """
    low, extent = way.interval()
    ends = way.kinks(low, low + extent) if double else (low, low + extent)

    def at(node: Any, captured: Any) -> tuple:
        way, tilts, ends, width, e = captured
        sums: list = [0] * (4 if e else 3)
        for begin, end in pairwise(ends):
            tilt = begin + (end - begin) * node
            l, r = sincos(way.first_tilt(tilt)), sincos(tilt)
            weight = (end - begin) * tilts.product(l, r) * l[0] * r[0] * width(l, r)
            factors = [1, tilt, tilt * tilt] + ([way.reflected(tilt, e)] if e else [])
            sums = [total + weight * factor for total, factor in zip(sums, factors)]
        return tuple(sums)

    # A few nodes are a third faster as copies, which a plain number stands for.
    like = way.p if double or e else 0.0
    return integrate(at, nodes, (way, tilts, ends, Width.of(way), e), like, nested=True)


def _reaches(x: tuple, near: tuple, far: tuple) -> tuple[Any, Any]:
    """f_0 and f_1 times sin l sin r, of light that meets the ``near`` facet first; arguments are sines and cosines.

    By `kaleidoscope.reach`, -sin(near) cos(x + far) and sin(far) cos(x - near). For the reversed path, from y, whose
    near facet is that of the last bounce, they are f_(k+1) and f_k.
    """
    (sin_x, cos_x), (sin_near, cos_near), (sin_far, cos_far) = x, near, far
    return -sin_near * (cos_x * cos_far - sin_x * sin_far), sin_far * (cos_x * cos_near + sin_x * sin_near)


def nonsymmetric_way(psi: tuple, tilt: tuple, partner: tuple, u: Any, most: Any) -> tuple[Any, Any, tuple]:
    """(swap, k, exit): `entrance`, `bounces` and `exit_angle` in closed form; angles are sines and cosines.

    At the image m of a facet the ray is at the angle x_m, which grows by twice the aperture from one image of the facet
    to its next; it reflects if sin x_m is more than its offset from the apex times the sine of the facet's tilt. Since
    the rims are corners of a convex polygon, it leaves where that is so no more for the first time: beyond pi/2, but
    for the image 2, whose rim may be nearer than that of 1.
    """
    (sin_psi, cos_psi), (sin_l, cos_l), (sin_r, cos_r) = psi, tilt, partner
    left, right = cos_psi * cos_l + sin_psi * sin_l, cos_psi * cos_r - sin_psi * sin_r
    inverse_l, inverse_r = reciprocals(greater(sin_l, 1e-10), greater(sin_r, 1e-10))
    offsets = [dr.lerp(left * sin * inverse_l, -right * sin * inverse_r, u) for sin in (sin_l, sin_r)]
    swap = offsets[0] < 0
    sines = [lesser(dr.abs(dr.select(swap, a, b)), 1) for a, b in (offsets[::-1], offsets)]
    cosines = [dr.sqrt((1 - sin) * (1 + sin)) for sin in sines]
    size, l, r, first, second = angles((cos_psi, dr.abs(sin_psi)), (cos_l, sin_l), (cos_r, sin_r), *zip(cosines, sines))
    psi = dr.select((sin_psi < 0) ^ swap, -size, size)
    aperture = greater(dr.pi - l - r, 1e-6)
    l = dr.select(swap, r, l)
    x = psi + dr.pi / 2 - l
    inverse = dr.rcp(2 * aperture)
    even = 2 * greater(dr.floor((dr.pi - first - x) * inverse) + 1, 1)  # bounces before an image of L is missed
    odd = 2 * greater(dr.floor((dr.pi - second - x + aperture) * inverse) + 1, 1) - 1  # before one of R
    k = lesser(dr.select(x + aperture < second, 1, lesser(even, odd)), type(u)(most) + 1)
    last = dr.select(k - 2 * dr.floor(k / 2) > 0.5, 2 * l - psi - (k - 1) * aperture, psi - dr.pi + k * aperture)
    return swap, k, sincos(clamp(last, -dr.pi / 2, dr.pi / 2))
