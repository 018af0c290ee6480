"""Lambertian grains, integrated over their normals without noise (Lucas et al. 2024, Eq. 21).

With m' on the unit hemisphere of sphere space, at height h and azimuth x, Eq. 21 becomes

    tau_0 f_d cos_o = K_d / pi * r / i'_z * int_0^1 dh exp(-r (pi (1 - h^2) + U(h)))
                      int dx (i' . m')+ (E o . m')+ T / |E m'|,

where the area U of the shadows does not depend on x. Replacing U by the shadow along i alone, and dropping K_d and T,
gives the density of this way to sample: a visible normal first, then the cosine lobe about it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr

from ...lobes import Lobe
from ...microfacet.fast import exp_of_negative, greater, sincos
from ...microfacet.numerics import TINY, heading, normalised
from ...microfacet.quadrature import RULES, Rule, integrate
from ...microfacet.sampling import about, cosine_hemisphere, split
from .grains import Grains
from .material import Facet, Material
from .shadows import Shadows

# fmt: off
HEIGHTS: Rule = (
    (0.99999507, 0.99985764, 0.9992813, 0.99799518, 0.99579025, 0.99175819, 0.98395383, 0.96882886,
     0.93825677, 0.88079583, 0.78563192, 0.63849252, 0.46241259, 0.28173457, 0.12884615, 0.030159063),
    (1.9901226e-05, 0.00032090145, 0.00086514632, 0.0017430864, 0.0027881084, 0.0056446717, 0.010480591, 0.021190192,
     0.041823697, 0.074926728, 0.11906232, 0.16861566, 0.18325799, 0.17030383, 0.13174946, 0.066998966),
)
# fmt: on
"""Nodes and weights in h, crowded at the top, which alone is seen at grazing.

Fitted, for value and density of 26 000 random inputs of the whole range: least squares from Gauss-Legendre nodes in
(1 - h)^(1/3) on, then the norms of exponents 4, 8, 12 of the relative error."""
RULES.add(HEIGHTS)
FRONT = (0, 1), (0.514716, 0.923746), (0.911243, 0.485973)
BACK = (0, 1.4346), (0.713981, 1.102812)
"""Pairs of node and weight on half a lit arc, the front one and the back one, which is mostly empty, of round grains:
fitted likewise to coats of index 1.01 to 2.5 and to colours by normal."""
AROUND = 20, 10
"""Even nodes on either arc, of other grains, and of coats that may reflect totally."""


class Integral(NamedTuple):
    """f_d cos_o for albedo 1, shared out to the two albedos that a grain may have, and the sampling density."""

    first: Any
    second: Any
    pdf: Any


def lambertian(
    grains: Grains,
    wi: Any,
    wo: Any,
    shaded: Callable[[Shadows, Any], Any],
    facet: Facet,
    *,
    isotropic: bool = False,
) -> Integral:
    """Integrate Lambertian grains seen from ``wi`` and lit from ``wo``, both above the surface (Lucas 2024, Eq. 21).

    ``pdf`` is not normalised: it integrates to the visible fraction tau_i, less what goes below the horizon.
    ``shaded(shadows, h)`` is the area of the shadows at height h, by the choice of masking: `Shadows.union` or
    `Shadows.sum`. Grains of beta_x = beta_y may be called ``isotropic``: the integral over the azimuth then has a
    closed form, if facets are alike around the grain.
    """
    i, o = grains.to_sphere(wi), grains.to_sphere(wo)
    stretch_i, stretch_o = grains.stretch(wi), grains.stretch(wo)
    rings = Rings(grains, facet, isotropic, Shadows(i, o), stretch_i, stretch_o)

    def at_height(h: Any, captured: tuple[Rings]) -> tuple[Any, Any, Any]:
        (rings,) = captured
        disc, r = dr.pi * (1 - h * h), rings.grains.r
        first, second, lit = rings.at(h)
        exposed = exp_of_negative(-r * (disc + shaded(rings.shadows, h)))
        visible = exp_of_negative(-r * (disc + rings.shadows.first(h)))
        return exposed * first, exposed * second, visible * lit

    first, second, pdf = integrate(at_height, HEIGHTS, (rings,), grains.r * wi.z)
    scale = grains.r * stretch_o / (dr.pi * i.z)
    return Integral(scale * first, scale * second, scale * pdf)


@dataclass
class Rings:
    """The rings of a grain: integrals over the azimuth x of (i'.m')+ (o'.m')+ T / |E m'| at any height.

    With R^2 = 1 - h^2, and x from i towards o, i'.m' = i_z h + sin_i R cos(x) is positive for |x| < pi - gamma_i, and
    o'.m' = o_z h + sin_o R cos(x - between) likewise. So what is dark of the ring are two arcs of half widths gamma
    about pi and pi + between; what is lit is one arc, or two if light comes from behind and they are apart.
    """

    grains: Grains
    facet: Facet
    isotropic: bool
    shadows: Shadows
    stretch_i: Any  # |E wi|
    stretch_o: Any
    axis: tuple[Any, Any] | None = None  # unit vector at x = 0
    turn: Any = None  # 1 if x is counted counterclockwise, else -1

    def __post_init__(self) -> None:
        if self.axis is not None:  # a copy of Dr.Jit's, in a loop
            return
        i, o, shadows = self.shadows.i, self.shadows.o, self.shadows
        self.turn = dr.select(i.x * o.y < i.y * o.x, type(i.x)(-1), 1)
        # The more inclined of both has an azimuth; that of the other follows, although it may be upright.
        inclined = i.z < o.z
        x, y = heading(dr.select(inclined, i.x, o.x), dr.select(inclined, i.y, o.y))
        back_x, back_y = _rotated(x, y, shadows.cos_between, -self.turn * shadows.sin_between)
        self.axis = dr.select(inclined, x, back_x), dr.select(inclined, y, back_y)

    def at(self, h: Any) -> tuple[Any, Any, Any]:
        """Integrals for the first albedo, for the second, and without T."""
        product, facet = self.product(h), self.facet
        if self.isotropic and facet.alike_around:
            lit = product * dr.rsqrt(dr.square(self.grains.beta_x) * (1 - h * h) + h * h)
            second = facet.second(h, None) * lit if facet.second else 0 * lit
            return lit - second, second, lit
        value, second, lit = self.means(h)
        return product * (value - second), product * second, product * lit

    def product(self, h: Any) -> Any:
        """Integral of (i'.m')+ (o'.m')+, in closed form: that of the whole ring, less that of its dark arcs.

        From the middle of a dark arc, a_i - b_i cos(x) and a_o - b_o cos(x - between) have the product's primitive

            P(x) = k_1 x - k_2 sin(x - between) - k_3 sin(x) + k_4 sin(2 x - between).

        Dark arcs that are apart, or one in the other, have 2 P's odd part at x = gamma each, or the wider one alone;
        those that overlap are one arc, from the far end of one to that of the other.
        """
        (i, o), between = self.shadows.at(h), self.shadows.between
        cos, sin = self.shadows.cos_between, self.shadows.sin_between
        radius = dr.sqrt((1 - h) * (1 + h))
        a_i, b_i, a_o, b_o = i.outline.cos * h, i.outline.sin * radius, o.outline.cos * h, o.outline.sin * radius
        k_1, k_2, k_3, k_4 = a_i * a_o + b_i * b_o * cos / 2, a_i * b_o, a_o * b_i, b_i * b_o / 4
        odd_i = k_1 * i.gamma + i.sin_gamma * (cos * (2 * k_4 * i.cos_gamma - k_2) - k_3)
        odd_o = k_1 * o.gamma + o.sin_gamma * (cos * (2 * k_4 * o.cos_gamma - k_3) - k_2)
        even = k_4 * (_double(i.cos_gamma) + _double(o.cos_gamma)) - k_2 * i.cos_gamma - k_3 * o.cos_gamma
        overlapping, difference = k_1 * between + sin * even, odd_i - odd_o
        rest = dr.select(between > i.gamma + o.gamma, odd_i + odd_o, overlapping)
        wider = dr.select(i.gamma > o.gamma, difference, -difference)
        rest = dr.select(between < dr.abs(i.gamma - o.gamma), wider, rest)
        return greater(2 * dr.pi * k_1 - (odd_i + odd_o + rest), 0)

    def means(self, h: Any) -> tuple[Any, Any, Any]:
        """Means over the azimuth of T / |E m'|, of the second albedo's share of it, and without T.

        Weighted by (i'.m')+ (o'.m')+: errors of the rule that both have in common cancel.
        """
        grains, (i, o), facet = self.grains, (self.shadows.i, self.shadows.o), self.facet
        whole, value, second, lit = TINY, 0, 0, 0
        for x, y, width in self.nodes(h):
            toward_i, toward_o = (greater(w.x * x + w.y * y + w.z * h, 0) for w in (i, o))
            m = type(i)(grains.beta_x * x, grains.beta_y * y, h)
            length = dr.rsqrt(dr.squared_norm(m))
            seen = width * toward_i * toward_o
            term = seen * length
            whole, lit = whole + seen, lit + term
            if facet.coat:
                cos_i, cos_o = self.stretch_i * toward_i * length, self.stretch_o * toward_o * length
                term = term * facet.coat.through(cos_i) * facet.coat.through(cos_o)
            value = value + term
            if facet.second:
                second = second + term * facet.second(h, m * length)
        scale = 1 / whole
        return value * scale, second * scale, lit * scale

    def nodes(self, h: Any) -> Iterator[tuple[Any, Any, Any]]:
        """(m'_x, m'_y, weight) at the nodes of a rule on either lit arc."""
        (i, o), between, axis = self.shadows.at(h), self.shadows.between, self.axis
        assert axis is not None
        alike = self.isotropic and self.facet.smooth
        early, late = greater(i.gamma, o.gamma + between), greater(i.gamma, o.gamma - between)
        front = (early - late) / 2, dr.pi - (early + late) / 2, 1  # middle, half width, and side
        back = (between + i.gamma - o.gamma) / 2, greater(between - i.gamma - o.gamma, 0) / 2, -1
        radius = dr.sqrt((1 - h) * (1 + h))
        for (middle, half, side), few, many in zip((front, back), (FRONT, BACK), AROUND):
            sin, cos = sincos(middle)
            x, y = _rotated(*axis, side * cos, side * self.turn * sin)
            for x, y, width in _few(x, y, half, few) if alike else self._many(x, y, half, h, many):  # noqa: B020
                yield radius * x, radius * y, width

    def _many(self, x: Any, y: Any, half: Any, h: Any, count: int) -> Iterator[tuple[Any, Any, Any]]:
        """Directions about the middle (x, y) of an arc, even in an angle t in which |E m'| is less uneven.

        tan(azimuth) = k tan(t), with k^2 the ratio of |E m'| along the axes of the grain.
        """
        flat, high = (1 - h) * (1 + h), h * h
        along, across = (high + flat * dr.square(beta) for beta in (self.grains.beta_x, self.grains.beta_y))
        k = dr.sqrt(dr.sqrt(along / across))
        sin, cos = sincos(half)
        ends = _rotated(x, y, cos, -sin), _rotated(x, y, cos, sin)
        ahead = [dr.atan2((1 - k) * x * y, k * x * x + y * y) for x, y in ends]  # of t, of the azimuth
        step = (2 * half + ahead[1] - ahead[0]) / count
        (sin, cos), (sin_half, cos_half) = sincos(step), sincos(step / 2)
        u, v = _rotated(*normalised(k * ends[0][0], ends[0][1]), cos_half, sin_half)
        for _ in range(count):
            scale = dr.rsqrt(u * u + k * k * v * v)
            yield u * scale, k * v * scale, step * scale * scale  # but for the factor k
            u, v = _rotated(u, v, cos, sin)


def _few(x: Any, y: Any, half: Any, rule: Iterable[tuple[float, float]]) -> Iterator[tuple[Any, Any, Any]]:
    """Directions about the middle (x, y) of an arc, at the nodes of a rule."""
    for t, weight in rule:
        sin, cos = sincos(t * half)
        yield *_rotated(x, y, cos, sin), weight * half
        if t:
            yield *_rotated(x, y, cos, -sin), weight * half


def _rotated(x: Any, y: Any, cos: Any, sin: Any) -> tuple[Any, Any]:
    """(x, y) turned counterclockwise."""
    return x * cos - y * sin, y * cos + x * sin


def _double(cos: Any) -> Any:
    """Cosine of twice the angle."""
    return 2 * cos * cos - 1


@dataclass
class Lambertian(Lobe):
    """The lobe of diffuse grains, bare or under a coat (Lucas 2024, Eq. 21)."""

    grains: Grains
    material: Material
    shaded: Callable[[Shadows, Any], Any]
    isotropic: bool

    def share(self, wi: Any) -> Any:
        """What is seen of grains, but for what is left to their specular lobe."""
        return self.grains.visible(wi) * self.material.diffuse_part(wi.z)

    def eval_pdf(self, wi: Any, wo: Any) -> tuple[Any, Any]:
        """tau_0 f_d cos_o, and the density of cosine lobes about visible normals."""
        material = self.material
        first, second, pdf = lambertian(self.grains, wi, wo, self.shaded, material.facet, isotropic=self.isotropic)
        value = material.albedo * first
        if material.albedo_2 is not None:
            value = value + material.albedo_2 * second
        return value, pdf / self.grains.visible(wi)

    def draw(self, wi: Any, u: Any, v: Any) -> Any:
        """A cosine lobe about a visible normal: four numbers, of the three that Mitsuba hands out."""
        return about(self.grains.visible_normal(wi, v.x, v.y), cosine_hemisphere(*split(u)))
