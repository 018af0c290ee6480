"""Light that meets two facets of a V-cavity, or more, without noise.

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

All that bounces more often is returned by what is missing then. With eps(i) = 1 - the albedo of one bounce and two, if
the body absorbs nothing, and its hemispherical mean,

    f of more = r(Q) eps(i) eps(o) / (pi eps_mean)

is reciprocal, and closes the white furnace; r is the share of it that is left if the body does absorb, `more_bounces`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import numpy as np

from ...lobes import Lobe
from ...microfacet.distributions import Distribution
from ...microfacet.masking import cavity_visible_and_lit
from ...microfacet.numerics import clamp, heading
from ...microfacet.quadrature import by_grazing, gauss_legendre, integrate, over_normals
from ...microfacet.sampling import reflect
from ...microfacet.tables import Table
from .body import GRAZING, body_albedo, fresnel, outer_reflectance, transmitted, transmitted_twice

OUT_OF_PLANE = (0.31865891, 0.05074302), (0.69997913, 0.31023642), (0.96318908, 0.63902056)
"""(cos w, weight): Gauss's rule for means over the angle w out of a cavity's plane, by cos^2 w."""
TILTS, PARTS = 32, 12
"""Nodes of the table of tau."""
POLE = 1e-3
"""Least |sin| in the divisor of `mirrored_twice`, in radians from the mirror direction: a larger one would be seen."""
TINY = 1e-9
COSINES, AZIMUTHS, SHADES = 48, 7, 33
"""Nodes of the tables of `More`: in the root of the cosine and in the azimuth of the first quadrant, and in Q."""


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


# --- more bounces ----------------------------------------------------------------------------------------------------


def even_light(cos_m: Any, n: Any) -> tuple[Any, Any]:
    """Means of T, and of T T, over even light from all of a facet to all of the other.

    Light at the angle psi from along one facet meets the other at 2 theta - psi, so one integral is left:
    int_0^theta sin psi <T(sin psi cos w) T(sin(2 theta - psi) cos w)> dpsi / (1 - cos theta), < > by `OUT_OF_PLANE`.
    """
    theta = dr.acos(cos_m)

    def leaving(t: Any, captured: tuple) -> tuple:
        theta, n = captured
        psi, once, twice = theta * t, 0, 0
        out, into = dr.sin(psi), dr.sin(2 * theta - psi)
        for cos, share in OUT_OF_PLANE:
            t_out, t_into = transmitted(out * cos, n), transmitted(into * cos, n)
            once, twice = once + share * (t_out + t_into) / 2, twice + share * t_out * t_into
        return theta * out * once, theta * out * twice

    whole = 2 * dr.square(dr.sin(theta / 2))
    once, twice = integrate(leaving, 16, (theta, n), theta)
    return once / whole, twice / whole


def more_bounces(cos_m: Any, n: Any, scale: Any, once: Any, twice: Any) -> Any:
    """Share of diffuse light that leaves a cavity after three bounces or more, roughly; ``scale`` is Q.

    Of `even_light` it takes <T> = ``once`` and <T T> = ``twice``.

    Every facet is taken to be lit, and to shine, evenly. Of what it shines, F_1 = 1 - cos theta meets the other one;
    of that in turn, if it is mirrored there, the share again meets a facet once more, for which the kaleidoscope gives
    (1 - sin 2 theta) / F_1 if the tilt exceeds 45 degrees. What bodies take in comes out as W in the end, what is
    mirrored as M:

        W = Q (1 - r_e - F_1 <T>) + Q F_1 (<T> - <T T>) M + Q F_1 <T T> W,
        M = 1 - again + again (1 - <T> + <T> W).
    """
    meet, r_e = 1 - cos_m, outer_reflectance(n)
    again = dr.select(cos_m < math.sqrt(0.5), 1 - 2 * cos_m * dr.sqrt(1 - cos_m * cos_m), 0) / meet
    mirrored, taken = scale * meet * (once - twice), scale * meet * twice
    base = 1 - again * once
    end = (scale * (1 - r_e - meet * once) + mirrored * base) / (1 - taken - mirrored * again * once)
    third, later = mirrored * (base + again * once * end) + taken * end, again * (1 - once + once * end)
    entering = meet * (1 - again) / cos_m  # share of what enters that is mirrored first, and meets the other facet then
    body_first = (1 - r_e) * (taken * third + mirrored * later)
    return body_first + entering * ((once - twice) * third + (1 - 2 * once + twice) * later)


def mirrored_albedo(distribution: Distribution, n: Any, wi: Any) -> Any:
    """Share of the light along ``wi`` that leaves after one reflection by the interfaces, or two."""

    def of_cavity(m: Any, captured: tuple) -> tuple:
        n, wi = captured
        m = dr.normalize(m)
        lit, other = Met.along(wi, m), opposite(m)
        facing, wo = dr.maximum(lit.facing, TINY), reflect(wi, m)
        once = cavity_visible_and_lit(facing, facing, wi.z, wo.z, m.z) / (facing * m.z)
        last = wo - 2 * dr.dot(wo, other) * other
        seen = Met.along(type(wi)(last.x, last.y, dr.maximum(last.z, TINY)), other)
        part, cos = mirrored_part(wi, m, lit, seen)
        twice = 2 * part * fresnel(cos, n)
        leaves = dr.select(wo.z > 0, once, 0) + dr.select(last.z > 0, twice, 0)
        return (dr.select(lit.facing > 0, leaves * fresnel(facing, n), 0) / wi.z,)

    return over_normals(of_cavity, distribution, wi, (n, wi), 32, 16)[0]


@dataclass
class More:
    """All that bounces more than twice."""

    missing: Table  # eps / sqrt(pi eps_mean) over the root of the cosine, and the azimuth of the first quadrant
    left: Table  # r over Q / Q_1, Q_1 being that of a body that absorbs nothing

    @classmethod
    def made(
        cls,
        distribution: Distribution,
        n: Any,
        body: Callable[[Any, Any], Any],
        Vector: Any,
        isotropic: bool,
        rule: tuple[int, int] = (24, 24),
    ) -> More:
        """For constants, arrays of one number; ``body(wi, wo)`` is f, without what is mirrored only, if Q is Q_1.

        The ``rule`` is for its albedo: cosines and azimuths. If the constants have derivatives, so do the tables.
        """
        Float = type(n)
        azimuths = 1 if isotropic else AZIMUTHS
        root, azimuth = np.meshgrid(np.linspace(0, 1, COSINES), np.linspace(0, 0.5, azimuths), indexing="ij")
        cos = np.maximum(root.ravel() ** 2, GRAZING)
        sin = np.sqrt(1 - cos * cos)
        turns = azimuth.ravel() * np.pi
        wi = Vector(*(Float(x.astype(np.float32)) for x in (sin * np.cos(turns), sin * np.sin(turns), cos)))
        white = body_albedo(1, n)
        returned = mirrored_albedo(distribution, n, wi) + body_share(body, wi, *rule)
        eps = Table.of((COSINES, azimuths), [dr.maximum(1 - returned, 0)])
        mean = dr.maximum(cls.hemispherical(eps, Float), TINY)
        missing = replace(eps, entries=eps.entries / dr.sqrt(math.pi * mean))
        dr.eval(missing.entries)
        return cls(missing, cls.colour(distribution, n, white))

    @staticmethod
    def hemispherical(missing: Table, Float: Any) -> Any:
        """Mean of a table of eps over the hemisphere, by cosine: of its interpolation, exactly enough."""
        squares, turns = 256, 1 if missing.shape[1] == 1 else 16
        root, turn = np.meshgrid((np.arange(squares) + 0.5) / squares, (np.arange(turns) + 0.5) / turns, indexing="ij")
        weight = 4 * root**3 / (squares * turns)  # 2 cos dcos
        root, turn, weight = (Float(x.ravel().astype(np.float32)) for x in (root, turn, weight))
        return dr.sum(weight * missing.at(root, turn)[0])

    @staticmethod
    def colour(distribution: Distribution, n: Any, white: Any) -> Table:
        """The table of r."""
        Float = type(n)
        UInt = dr.uint32_array_t(Float)
        shade = Float(np.linspace(0, 1, SHADES).astype(np.float32))
        upright = dr.replace_shape_t(Float, (3, -1))(0, 0, 1)
        # A table of even light too: integrals inside the loop over normals have no derivatives backwards.
        root = np.clip(np.linspace(0, 1, TILTS), 1e-3, 0.999)
        even = Table.of((TILTS,), even_light(Float((1 - root * root).astype(np.float32)), n))

        def of_cavity(m: Any, captured: tuple) -> tuple:
            n, white, shade, even = captured
            cos_m = dr.minimum(dr.rcp(dr.norm(m)), 1 - 1e-6)
            return (more_bounces(cos_m, n, white * shade, *even.at(dr.sqrt(1 - cos_m))),)

        energy = over_normals(of_cavity, distribution, upright, (n, white, shade, even), 32, 4)[0]
        whole = dr.gather(Float, energy, UInt(SHADES - 1))
        return Table.of((SHADES,), [dr.maximum(energy, 0) / dr.maximum(whole, TINY)])

    def native(self) -> More:
        """The same for the active variant."""
        return More(self.missing.native(), self.left.native())

    def __call__(self, wi: Any, wo: Any, shade: Any) -> Any:
        """f per steradian, for a body of this Q / Q_1, a number."""
        return self.left.at(shade)[0] * self._missing(wi) * self._missing(wo)

    def _missing(self, w: Any) -> Any:
        turn = 0
        if self.missing.shape[1] > 1:
            cos, sin = heading(w.x, w.y)
            turn = dr.atan2(dr.abs(sin), dr.abs(cos)) * (2 / math.pi)
        return self.missing.at(dr.sqrt(w.z), turn)[0]


def body_share(body: Callable[[Any, Any], Any], wi: Any, cosines: int, azimuths: int) -> Any:
    """Albedo along ``wi`` of f = ``body(wi, wo)``: by Gauss's nodes in the root of the cosine, and even azimuths."""
    Float, Vector = type(wi.z), type(wi)
    UInt = dr.uint32_array_t(Float)
    (root, share), size = np.array(gauss_legendre(cosines)), cosines * azimuths
    cos, turn = np.repeat(root**2, azimuths), np.tile((np.arange(azimuths) + 0.5) / azimuths, cosines) * 2 * np.pi
    sin, weight = np.sqrt(1 - cos * cos), np.repeat(share * root**3, azimuths) * (4 * np.pi / azimuths)
    nodes = dr.width(wi)
    parts = sin * np.cos(turn), sin * np.sin(turn), cos, weight
    *wo, weight = (dr.tile(Float(part.astype(np.float32)), nodes) for part in parts)
    along = dr.gather(Vector, wi, dr.repeat(dr.arange(UInt, nodes), size))
    return dr.block_sum(weight * body(along, Vector(*wo)), size)
