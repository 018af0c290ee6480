"""Lambertian grains, integrated over their normals without noise (Lucas et al. 2024, Eq. 21).

With m' on the unit hemisphere of sphere space, at height h and azimuth x, Eq. 21 becomes

    tau_0 f_d cos_o = K_d / pi * r / i'_z * int_0^1 dh exp(-r (pi (1 - h^2) + U(h)))
                      int dx (i' . m')+ (E o . m')+ T / |E m'|,

where the area U of the shadows does not depend on x. Replacing U by the shadow along i alone, and dropping K_d and T,
gives the density of this way to sample: a visible normal first, then the cosine lobe about it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
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
from .shadows import Cut, Shadows, shadow

HEIGHTS: Rule = (
    (0.9999997, 0.99984726, 0.99915907, 0.99757463, 0.99459839, 0.98910712, 0.97815752, 0.95715387)
    + (0.91996308, 0.85700717, 0.76286468, 0.62777942, 0.45821171, 0.27114857, 0.11861464, 0.023937673),
    (1.848649e-06, 0.0003957211, 0.0010347386, 0.0022168388, 0.0039061404, 0.0075616562, 0.015159354, 0.027675225)
    + (0.048518598, 0.078293067, 0.11209211, 0.1562851, 0.18174437, 0.18118071, 0.12300935, 0.060674567),
)
"""Nodes and weights in h, crowded at the top, which alone is seen at grazing: fitted (`fit`)."""
RULES.add(HEIGHTS)
FRONT = (0, 1), (0.514716, 0.923746), (0.911243, 0.485973)
BACK = (0, 1.4346), (0.713981, 1.102812)
"""(node, weight) pairs on half a lit arc, the front one and the back one, which is mostly empty; fitted."""
AROUND = 16, 8
"""Midpoints on either arc, of grains that are not round."""


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
    rings = Rings(grains, Shadows(i, o), facet, isotropic, stretch_i, stretch_o)

    def at_height(h: Any, captured: tuple[Rings]) -> tuple[Any, Any, Any]:
        (rings,) = captured
        disc, r = dr.pi * (1 - h * h), rings.grains.r
        first, second, lit = rings.at(h)
        exposed = exp_of_negative(-r * (disc + shaded(rings.shadows, h)))
        visible = exp_of_negative(-r * (disc + shadow(rings.shadows.i, h)))
        return exposed * first, exposed * second, visible * lit

    first, second, pdf = integrate(at_height, HEIGHTS, (rings,), grains.r * wi.z)
    scale = grains.r * stretch_o / (dr.pi * i.z)
    return Integral(scale * first, scale * second, scale * pdf)


@dataclass
class Rings:
    """Rings of a grain at any height: integrals over the azimuth x, from i towards o, of (i'.m')+ (o'.m')+ T / |E m'|.

    i'.m' = i_z h + sin_i R cos(x) and o'.m' = o_z h + sin_o R cos(x - between), where R^2 = 1 - h^2.
    """

    grains: Grains
    shadows: Shadows
    facet: Facet
    isotropic: bool
    stretch_i: Any  # |E wi|
    stretch_o: Any

    def at(self, h: Any) -> tuple[Any, Any, Any]:
        """Integrals for the first albedo, for the second, and without T."""
        i, o = self.shadows.at(h)
        product = self.product(h, i, o)
        facet = self.facet
        if self.isotropic and facet.alike_around:
            lit = product * dr.rsqrt(dr.square(self.grains.beta_x) * (1 - h * h) + h * h)
            second = facet.second(h, None) * lit if facet.second else 0 * lit
            return lit - second, second, lit
        value, second, lit = self.means(h, i, o)
        return product * (value - second), product * second, product * lit

    def product(self, h: Any, i: Cut, o: Cut) -> Any:
        """Integral of (i'.m')+ (o'.m')+, in closed form."""
        *_, between, cos, sin = self.shadows.parts
        R2, hR = 1 - h * h, h * dr.sqrt((1 - h) * (1 + h))
        sines = i.outline.sin * o.outline.sin
        k1 = h * h * (i.outline.cos * o.outline.cos) + R2 / 2 * (sines * cos)
        k2, k3, k4 = hR * (i.outline.cos * o.outline.sin), hR * (o.outline.cos * i.outline.sin), R2 / 4 * sines
        odd_i = k1 * i.gamma + i.sin_gamma * (2 * k4 * cos * i.cos_gamma - k2 * cos - k3)
        odd_o = k1 * o.gamma + o.sin_gamma * (2 * k4 * cos * o.cos_gamma - k3 * cos - k2)
        both = 2 * k4 * (i.cos_gamma * i.cos_gamma + o.cos_gamma * o.cos_gamma - 1) - k2 * i.cos_gamma - k3 * o.cos_gamma
        partial = k1 * between + sin * both
        less = odd_i - odd_o
        x = dr.select(between > i.gamma + o.gamma, odd_i + odd_o, partial)
        x = dr.select(between < dr.abs(i.gamma - o.gamma), dr.select(i.gamma > o.gamma, less, -less), x)
        return greater(2 * dr.pi * k1 - (odd_i + odd_o + x), 0)

    def means(self, h: Any, i: Cut, o: Cut) -> tuple[Any, Any, Any]:
        """Means over the azimuth, weighted by (i'.m')+ (o'.m')+, of T / |E m'|, of the second's, and without T."""
        facet, grains = self.facet, self.grains
        Vector: Any = type(self.shadows.i)
        total, value, second, lit = TINY, 0, 0, 0
        for x, y, weight in self.nodes(h, i, o):
            q_i = greater(self.shadows.i.x * x + self.shadows.i.y * y + self.shadows.i.z * h, 0)
            q_o = greater(self.shadows.o.x * x + self.shadows.o.y * y + self.shadows.o.z * h, 0)
            m_x, m_y = grains.beta_x * x, grains.beta_y * y
            length = dr.rsqrt(m_x * m_x + m_y * m_y + h * h)
            share = weight * q_i * q_o
            total = total + share
            term = share * length
            lit = lit + term
            if facet.coat:
                term = term * facet.coat.through(self.stretch_i * q_i * length) * facet.coat.through(self.stretch_o * q_o * length)
            value = value + term
            second = second + (term * facet.second(h, Vector(m_x * length, m_y * length, h * length)) if facet.second else 0)
        scale = 1 / total
        return value * scale, second * scale, lit * scale

    def nodes(self, h: Any, i: Cut, o: Cut) -> Iterator[tuple[Any, Any, Any]]:
        """cos, sin, weight."""
        *_, between, _, _ = self.shadows.parts
        radius = dr.sqrt((1 - h) * (1 + h))
        early, late = greater(i.gamma, o.gamma + between), greater(i.gamma, o.gamma - between)
        front = (early - late) / 2, dr.pi - (early + late) / 2
        back = (between + i.gamma - o.gamma) / 2, greater(between - i.gamma - o.gamma, 0) / 2
        w, other = self.shadows.i, self.shadows.o
        turn = dr.select(w.x * other.y < w.y * other.x, -1, 1)
        inclined = self.shadows.parts[0].sin > self.shadows.parts[1].sin
        x, y = heading(dr.select(inclined, w.x, other.x), dr.select(inclined, w.y, other.y))
        _, _, _, _, _, _, cos, sin = self.shadows.parts
        x, y = dr.select(inclined, x, x * cos + turn * y * sin), dr.select(inclined, y, y * cos - turn * x * sin)
        k = None
        if not self.isotropic:
            R2 = (1 - h) * (1 + h)
            k = dr.sqrt(dr.sqrt((h * h + R2 * dr.square(self.grains.beta_x)) / (h * h + R2 * dr.square(self.grains.beta_y))))
        for (middle, half), rule, count, sign in zip((front, back), (FRONT, BACK), AROUND, (1, -1)):
            sin, cos = sincos(middle)
            mx, my = sign * (cos * x - turn * sin * y), sign * (cos * y + turn * sin * x)
            if k is None:
                for t, weight in rule:
                    sin, cos = sincos(t * half) if t else (0, 1)
                    for s in (sin, -sin) if t else (0,):
                        yield radius * (cos * mx - s * my), radius * (cos * my + s * mx), weight * half
                continue
            sin, cos = sincos(half)
            (x0, y0), (x1, y1) = (cos * mx + sin * my, cos * my - sin * mx), (cos * mx - sin * my, cos * my + sin * mx)
            turned = [dr.atan2((1 - k) * v * u, k * u * u + v * v) for u, v in ((x0, y0), (x1, y1))]
            step = (2 * half + turned[1] - turned[0]) * (1 / count)
            u, v = normalised(k * x0, y0)
            (sin, cos), (sin_2, cos_2) = sincos(step), sincos(step / 2)
            u, v = u * cos_2 - v * sin_2, v * cos_2 + u * sin_2
            for n in range(count):
                scale = dr.rsqrt(u * u + k * k * v * v)
                yield radius * u * scale, radius * k * v * scale, step * scale * scale
                u, v = u * cos - v * sin, v * cos + u * sin


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
