"""Light that meets two facets of a V-cavity, without noise.

Meneveaux et al. (2018, Sec. 3.3) count it along random paths. But of two bounces all can be told. In a cavity, A = m is
the facet that light meets first and B = (-m_x, -m_y, m_z) the other one; the opening is 1 wide, and a facet
l = 1 / (2 m_z) deep. Distances on facets are from the rim.

    i_A, o_B    facing       cosines between the two directions and the facets' normals
    e_i, e_o    share        of what enters the opening along i, what meets A: min(1, i_A / (2 m_z i_z)); of o and B
    a, b        part         lit part of A, e_i i_z / i_A, and visible part of B
    F, T                     reflectance and transmittance of the interface
    Q                        body's albedo, all inner reflections included: see `body`
    X(a, b)     exchange     of even light between the two parts
    tau(a, b)   `EvenTransmittance`: mean of T T over that light

With weights w = D m_z dm, which add up to 1 over all normals, each facet of each cavity being m once,

    f of two bounces = Q^2 c_2 + Q c_1 + f_ss
    c_2  = 2 / pi sum w e_i e_o T(i_A) T(o_B) tau X / (a b)     body, body
    c_1  = S(i, o) + S(o, i)                                    mirror, body, and body, mirror
    S    = 2 / pi sum w F(i_A) T(d_B) T(o_B) L i_A o_B / (i_z o_z), for L on A that is mirrored along -d to b on B
    f_ss                                                        mirror, mirror, by two cavities alone: `mirrored_twice`
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np

from ...lobes import Lobe
from ...microfacet.distributions import Distribution
from ...microfacet.masking import cavity_visible_and_lit
from ...microfacet.numerics import clamp, heading
from ...microfacet.quadrature import by_grazing, gauss_legendre, over_normals
from ...microfacet.sampling import reflect
from ...microfacet.tables import Table
from .body import fresnel, transmitted_twice

OUT_OF_PLANE = (0.31865891, 0.05074302), (0.69997913, 0.31023642), (0.96318908, 0.63902056)
"""(cos w, weight): Gauss's rule for means over the angle w out of a cavity's plane, by cos^2 w."""
TILTS, PARTS = 32, 12
"""Nodes of the table of tau."""
POLE = 1e-3
"""Least |sin| in the divisor of `mirrored_twice`, in radians from the mirror direction: a larger one would be seen."""
TINY = 1e-9


# --- one cavity ------------------------------------------------------------------------------------------------------


@dataclass
class Met:
    """A facet of a cavity, as it is met along a direction."""

    facing: Any  # at least 0
    share: Any
    part: Any

    @classmethod
    def along(cls, w: Any, m: Any) -> Met:
        """The facet of normal ``m``."""
        facing, depth = dr.maximum(dr.dot(w, m), 0), dr.rcp(2 * m.z)
        return cls(facing, dr.minimum(1, facing * depth / w.z), dr.minimum(depth, w.z / dr.maximum(facing, TINY)))


def opposite(m: Any) -> Any:
    """Normal of the other facet."""
    return type(m)(-m.x, -m.y, m.z)


def exchange(a: Any, b: Any, cos_m: Any) -> Any:
    """X(a, b) / (a b), by Hottel's crossed strings.

    X = (|P_0 Q_1| + |P_1 Q_0| - |P_0 Q_0| - |P_1 Q_1|) / 2 with the rims P_0, Q_0 and the parts' lower ends P_1, Q_1;
    a and b are divided out by hand, or float32 would keep no digit of small ones.
    """
    k, two = 2 * cos_m * cos_m - 1, 2 * cos_m
    to_b = dr.sqrt(dr.maximum(1 + b * (b - two), TINY))  # |P_0 Q_1|
    from_a = dr.sqrt(dr.maximum(1 + a * (a - two), TINY))  # |P_1 Q_0|
    level, upright = 1 - (a + b) * cos_m, dr.square(a - b) * (1 - cos_m) * (1 + cos_m)
    ends = dr.sqrt(dr.square(level) + upright + TINY**2)  # |P_1 Q_1|, without cancellation at the bottom
    slope = (a - two) / (from_a + 1) + (a - two + 2 * b * k) / (ends + to_b)
    return dr.maximum(((b - two) * slope - 2 * k * (to_b + 1)) / (2 * (to_b + 1) * (ends + from_a)), 0)


def even_transmittance(a: Any, b: Any, cos_m: Any, n: Any) -> Any:
    """tau(a, b): the mean of T T over even light from a to b.

    An integral over directions in the cavity's plane, each as many as lie between both parts' ends, and over
    `OUT_OF_PLANE`. It is split where one of the four ends hides another.
    """
    sin = dr.sqrt(dr.maximum((1 - cos_m) * (1 + cos_m), TINY))
    lowest, highest = dr.atan2(-b * sin, 1 - b * cos_m), dr.atan2(a * sin, 1 - a * cos_m)  # P_0 Q_1, P_1 Q_0
    between = clamp(dr.atan2((a - b) * sin, 1 - (a + b) * cos_m + TINY), lowest, highest)  # P_1 Q_1; P_0 Q_0 is level
    ends = lowest, dr.minimum(between, 0), dr.maximum(between, 0), highest
    total, weights = 0, 0
    for start, end in itertools.pairwise(ends):
        for t, half in zip(*gauss_legendre(4)):
            up, level = dr.sincos(start + t * (end - start))
            out, into = dr.maximum(sin * level + cos_m * up, 0), dr.maximum(sin * level - cos_m * up, 0)
            width = dr.minimum(a * out - up / 2, b * into + up / 2) - dr.abs(up) / 2
            weight = half * (end - start) * dr.maximum(width, 0)
            for cos, share in OUT_OF_PLANE:
                total = total + share * weight * transmitted_twice(out * cos, into * cos, n)
            weights = weights + weight
    return total / dr.maximum(weights, TINY * TINY)


@dataclass
class EvenTransmittance:
    """`even_transmittance` of one index, as a table."""

    table: Table  # over sqrt(1 - m_z), a / l and b / l

    @classmethod
    def made(cls, n: Any) -> EvenTransmittance:
        """The table for an index that is an array of one number; of its type, and with its derivatives."""
        Float = type(n)
        axes = np.linspace(0, 1, TILTS), np.linspace(0, 1, PARTS), np.linspace(0, 1, PARTS)
        root, a, b = (np.maximum(x.ravel(), 0.01) for x in np.meshgrid(*axes, indexing="ij"))
        cos_m = np.maximum(1 - root * root, 1e-3)
        part_a, part_b, tilt = (Float(x.astype(np.float32)) for x in (a / (2 * cos_m), b / (2 * cos_m), cos_m))
        return cls(Table.of((TILTS, PARTS, PARTS), [even_transmittance(part_a, part_b, tilt, n)]))

    def native(self) -> EvenTransmittance:
        """The same for the active variant."""
        return EvenTransmittance(self.table.native())

    def __call__(self, a: Any, b: Any, cos_m: Any) -> Any:
        """Its value."""
        return self.table.at(dr.sqrt(dr.maximum(1 - cos_m, 0)), 2 * cos_m * a, 2 * cos_m * b)[0]


def mirrored_part(i: Any, m: Any, lit: Met, seen: Met) -> tuple[Any, Any]:
    """(L i_A, cosine on B) of light along ``i`` that A mirrors onto the visible part of B.

    From x on A it goes along d = 2 i_A m - i to (x i_A - d_z) / -d_B on B; L is the length of all x that are lit for
    which that is visible.
    """
    d_z = 2 * lit.facing * m.z - i.z
    cos = dr.maximum(-dr.dot(2 * lit.facing * m - i, opposite(m)), 0)
    on_lit, on_seen = lit.share * i.z - dr.maximum(d_z, 0), seen.part * cos + dr.minimum(d_z, 0)
    reached = dr.maximum(dr.minimum(on_lit, on_seen), 0)
    return dr.select((lit.facing > 0) & (seen.facing > 0), reached, 0), cos


# --- two bounces in all cavities -------------------------------------------------------------------------------------


def two_bounces(
    distribution: Distribution, n: Any, tau: EvenTransmittance, wi: Any, wo: Any, rings: int = 16, azimuths: int = 12
) -> tuple[Any, Any]:
    """(c_1, c_2), reciprocal: f of two bounces is Q c_1 + Q^2 c_2, and what is `mirrored_twice`."""

    def of_cavity(m: Any, captured: tuple) -> tuple:
        n, own, wi, wo = captured
        table, m = own or tau, dr.normalize(m)
        other = opposite(m)
        lit, seen = Met.along(wi, m), Met.along(wo, other)
        both = transmitted_twice(lit.facing, seen.facing, n) * lit.share * seen.share
        body_body = both * exchange(lit.part, seen.part, m.z) * table(lit.part, seen.part, m.z)
        part, cos = mirrored_part(wi, m, lit, seen)
        mirror_body = fresnel(lit.facing, n) * transmitted_twice(cos, seen.facing, n) * part * seen.facing
        part, cos = mirrored_part(wo, other, seen, lit)
        body_mirror = fresnel(seen.facing, n) * transmitted_twice(cos, lit.facing, n) * part * lit.facing
        return (mirror_body + body_mirror) / (wi.z * wo.z), body_body

    wi, wo = by_grazing(distribution, wi, wo)
    # A table without derivatives must not be part of the loop's state, where other arrays have some (Dr.Jit 1.5).
    own = tau if dr.grad_enabled(tau) else None
    once, twice = over_normals(of_cavity, distribution, wi, (n, own, wi, wo), rings, azimuths)
    return once * (2 / math.pi), twice * (2 / math.pi)


def mirrored_twice(distribution: Distribution, n: Any, wi: Any, wo: Any) -> tuple[Any, Any]:
    """(f_ss cos_o, density of these paths: the same of perfect mirrors, but for how a Gaussian is sampled).

    Two reflections turn -i about the cavity's axis by four times the tilt, so two cavities alone send i to o. They lie
    along the azimuth of i + o. Towards the mirror direction all of a family do: there is a pole, blunted to `POLE`.
    """
    x, y = heading(wi.x + wo.x, wi.y + wo.y)
    value, density = 0, 0
    for cos_phi, sin_phi in ((x, y), (-x, -y)):
        angle_i, angle_o = (dr.atan2(w.x * cos_phi + w.y * sin_phi, w.z) for w in (wi, wo))
        sin, cos = dr.sincos((math.pi + angle_i - angle_o) / 4)
        m = type(wi)(sin * cos_phi, sin * sin_phi, cos)
        lit, seen = Met.along(wi, m), Met.along(wo, opposite(m))
        part, _ = mirrored_part(wi, m, lit, seen)
        across = dr.sqrt(dr.maximum(1 - dr.square(wi.y * cos_phi - wi.x * sin_phi), TINY))
        pole = dr.maximum(dr.abs(dr.sin((angle_i + angle_o) / 2)), POLE)
        once = part / (8 * wi.z * across * pole)
        both = fresnel(lit.facing, n) * fresnel(seen.facing, n)
        value = value + distribution.density(m) * once * both
        density = density + distribution.sample_density(m) / m.z * once
    return value, density


@dataclass
class CavityMirrors(Lobe):
    """The lobe of the interfaces, once and twice mirrored, drawn as it happens: weights are Fresnel's terms."""

    distribution: Distribution
    n: Any
    mirrored: Callable[[Any], Any]  # w -> share of the light along w that facets mirror, roughly

    def share(self, wi: Any) -> Any:
        """That share."""
        return self.mirrored(wi)

    def eval_pdf(self, wi: Any, wo: Any) -> tuple[Any, Any]:
        """(f cos_o, density); what would bounce a third time is not returned."""
        m = dr.normalize(wi + wo)
        facing = dr.dot(wi, m)
        seen = cavity_visible_and_lit(facing, facing, wi.z, wo.z, m.z) / dr.square(facing)
        once = seen / (4 * wi.z)
        twice, density = mirrored_twice(self.distribution, self.n, wi, wo)
        value = self.distribution.density(m) * once * fresnel(facing, self.n)
        return value + twice, self.distribution.sample_density(m) / m.z * once + density

    def draw(self, wi: Any, u: Any, v: Any) -> Any:
        """Where a ray goes that enters a cavity anywhere; from below if it bounces a third time."""
        m = self.distribution.sample(v.x, v.y)
        first = u < Met.along(wi, m).share
        m, u = dr.select(first, m, opposite(m)), dr.select(first, u, 1 - u)
        once, other = reflect(wi, m), opposite(m)
        # From x = u i_z / i_A on the first facet to y on the second, and from there to z on the first again.
        cos = -dr.dot(once, other)
        y = (u * wi.z - once.z) / dr.maximum(cos, TINY)
        again = (cos > 0) & (y > 0)
        twice = once + 2 * cos * other
        back = -dr.dot(twice, m)
        z = (y * dr.dot(twice, other) - twice.z) / dr.maximum(back, TINY)
        out = dr.select((back > 0) & (z > 0), -1, twice.z)
        return dr.select(again, type(wi)(twice.x, twice.y, out), once)
