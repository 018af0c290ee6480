"""Light that meets two facets of a V-cavity, or more, without noise.

Meneveaux et al. (2018, Sec. 3.3) count it with random paths. But of two bounces all can be told: in a cavity, A = m is
the facet that light meets first and B = (-m_x, -m_y, m_z) the other one; the opening is 1 wide, a facet l = 1 / (2 m_z)
deep. Distances on facets are from the rim.

    i_A, o_B    cosines of the two directions on the facets
    e_i, e_o    shares of the opening's light along i that meets A, min(1, i_A / (2 m_z mu_i)), and of o and B
    a, b        lit part of A, e_i mu_i / i_A, and visible part of B
    F, T        Fresnel reflectance and transmittance of the interface; F + T = 1
    Q           K_d / (n^2 (1 - K_d r_i)): what the body returns, all inner reflections included
    X(a, b)     exchange of light between the two parts, if it is even: Hottel's crossed strings
    tau(m)      mean of T T over the light that goes from all of A to all of B

With weights w = D m_z dm, which add up to 1 over the hemisphere, either facet of each cavity being m once,

    f of 2 bounces = Q^2 c_2 + Q c_1 + f_ss
    c_2  = 2 / pi sum w e_i e_o T(i_A) T(o_B) X / (a b) tau     body, body
    c_1  = S(i, o) + S(o, i)                                    mirror, body; body, mirror
    f_ss                                                        mirror, mirror: only two cavities do it, see `mirrors`
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np

from ...microfacet.distributions import Distribution
from ...microfacet.masking import cavity_visible_and_lit
from ...microfacet.numerics import clamp, heading
from ...microfacet.quadrature import gauss_legendre, integrate, over_normals
from ...microfacet.sampling import reflect
from ...microfacet.tables import Table, array_types

TILTS, EXITS, TURNS = 64, 24, 12
"""Of the table of tau: its nodes, and those of the rule for each."""
POLE = 1e-3
"""Least |sin| in the divisor of `mirrors`, radians from the mirror direction: further out the clamp would be seen."""
TINY = 1e-9


def transmittance(cos: Any, eta: Any) -> Any:
    """T = 1 - F at a cosine in [0, 1], for a relative index >= 1: without cancellation at grazing, and 1 for eta = 1."""
    g = dr.sqrt(eta * eta - 1 + cos * cos)
    d, e = cos + g + TINY, eta * eta * cos + g + TINY
    return 2 * cos * g * (dr.rcp(dr.square(d)) + dr.square(eta / e))


# --- one cavity ------------------------------------------------------------------------------------------------------


@dataclass
class Facet:
    """A facet of a cavity, as a direction meets it."""

    cos: Any  # of the direction on it, at least 0
    share: Any  # e: of what enters the cavity
    part: Any  # a: what of the facet is met

    @classmethod
    def met(cls, w: Any, m: Any) -> Facet:
        """The facet of normal ``m``, met along ``w``."""
        cos, depth = dr.maximum(dr.dot(w, m), 0), dr.rcp(2 * m.z)
        return cls(cos, dr.minimum(1, cos * depth / w.z), dr.minimum(depth, w.z / dr.maximum(cos, TINY)))


def opposite(m: Any) -> Any:
    """Normal of the other facet."""
    return type(m)(-m.x, -m.y, m.z)


def exchange(a: Any, b: Any, cos_m: Any) -> Any:
    """X(a, b) / (a b) between the parts a and b of both facets, from the rims down.

    Of X = (|P_0 Q_1| + |P_1 Q_0| - |P_0 Q_0| - |P_1 Q_1|) / 2 with the rims P_0, Q_0 and the parts' lower ends P_1, Q_1,
    a and b are divided out, or float32 would keep no digit of small ones.
    """
    k, two = 2 * cos_m * cos_m - 1, 2 * cos_m
    to_b = dr.sqrt(dr.maximum(1 + b * (b - two), TINY))  # |P_0 Q_1|
    from_a = dr.sqrt(dr.maximum(1 + a * (a - two), TINY))  # |P_1 Q_0|
    ends = dr.sqrt(dr.maximum(1 + a * (a - two) + b * (b - two) + 2 * a * b * k, TINY))  # |P_1 Q_1|
    slope = (a - two) / (from_a + 1) + (a - two + 2 * b * k) / (ends + to_b)
    return dr.maximum(((b - two) * slope - 2 * k * (to_b + 1)) / (2 * (to_b + 1) * (ends + from_a)), 0)


def mirrored_part(i: Any, m: Any, lit: Facet, seen: Facet) -> tuple[Any, Any]:
    """(L i_A, cosine on B) of light along ``i`` that A mirrors onto the visible part of B.

    From x on A it goes along d = 2 i_A m - i to (x i_A - d_z) / -d_B on B; L is the length of all x that are lit for
    which that is visible.
    """
    d_z = 2 * lit.cos * m.z - i.z
    cos = dr.maximum(-dr.dot(2 * lit.cos * m - i, opposite(m)), 0)
    on_lit, on_seen = lit.share * i.z - dr.maximum(d_z, 0), seen.part * cos + dr.minimum(d_z, 0)
    return dr.maximum(dr.minimum(on_lit, on_seen), 0) & (lit.cos > 0) & (seen.cos > 0), cos


def transfer(cos_m: Any, eta: Any) -> Any:
    """tau, the mean of T T over even light from one facet to the other, of a cavity whose tilt has this cosine.

    Light from A at the angle psi from along A meets B at 2 theta - psi, whatever the distance, so one integral is left:
    tau = int_0^theta sin psi <T(sin psi cos w) T(sin(2 theta - psi) cos w)> dpsi / (1 - cos theta), where < > is the
    mean over the angle w out of the cavity's plane, by cos^2 w.
    """
    theta = dr.acos(cos_m)

    def leaving(t: Any, captured: tuple) -> tuple:
        theta, eta = captured
        psi = theta * t
        out, into = dr.sin(psi), dr.sin(2 * theta - psi)
        mean = 0
        for u, weight in zip(*gauss_legendre(TURNS)):
            cos = math.cos(math.pi / 2 * u)
            mean = mean + 2 * weight * cos**2 * transmittance(out * cos, eta) * transmittance(into * cos, eta)
        return (theta * out * mean,)

    return integrate(leaving, EXITS, (theta, eta), theta)[0] / (2 * dr.square(dr.sin(theta / 2)))


@dataclass
class Transfer:
    """tau of one index, as a table over the tilt."""

    table: Table

    @classmethod
    def made(cls, eta: Any, Float: Any) -> Transfer:
        """The table, in the precision of ``Float``."""
        root = np.maximum(np.linspace(0, 1, TILTS), 1e-3)
        return cls(Table.of((TILTS,), [transfer(Float(1 - root**2), Float(eta))]))

    def __call__(self, cos_m: Any) -> Any:
        """Tau."""
        return self.table.at(dr.sqrt(dr.maximum(1 - cos_m, 0)))[0]


# --- all cavities ----------------------------------------------------------------------------------------------------


def two_bounces(
    wi: Any, wo: Any, distribution: Distribution, eta: Any, tau: Transfer, rings: int = 16, azimuths: int = 32
) -> tuple[Any, Any]:
    """(c_1, c_2) per steradian: f of two bounces is Q c_1 + Q^2 c_2, and what `mirrors` adds."""
    towards = dr.select(wi.z < wo.z, wi, wo)

    def of_cavity(m: Any, captured: tuple) -> tuple:
        wi, wo, eta, tau = captured
        lit, seen = Facet.met(wi, m), Facet.met(wo, opposite(m))
        through = transmittance(lit.cos, eta), transmittance(seen.cos, eta)
        body_body = lit.share * seen.share * through[0] * through[1] * exchange(lit.part, seen.part, m.z) * tau(m.z)
        mirror_body, cos = mirrored_part(wi, m, lit, seen)
        mirror_body = mirror_body * (1 - through[0]) * through[1] * transmittance(cos, eta) * seen.cos
        body_mirror, cos = mirrored_part(wo, opposite(m), seen, lit)
        body_mirror = body_mirror * (1 - through[1]) * through[0] * transmittance(cos, eta) * lit.cos
        return (mirror_body + body_mirror) / (wi.z * wo.z), body_body

    once, twice = over_normals(of_cavity, distribution, towards, (wi, wo, eta, tau), rings, azimuths)
    return 2 / math.pi * once, 2 / math.pi * twice


def mirrors(wi: Any, wo: Any, distribution: Distribution, eta: Any) -> tuple[Any, Any]:
    """(f cos_o, density) of two mirror reflections; the density is f cos_o of perfect mirrors.

    Together they turn -i about the cavity's axis by four times the tilt, so two cavities alone send i to o. They lie
    along the azimuth of i + o, and in the mirror direction all do: there is a pole, blunted to `POLE`.
    """
    x, y = heading(wi.x + wo.x, wi.y + wo.y)
    value, density = 0, 0
    for cos_phi, sin_phi in ((x, y), (-x, -y)):
        across_i, across_o = (w.x * cos_phi + w.y * sin_phi for w in (wi, wo))
        along = wi.y * cos_phi - wi.x * sin_phi
        angle_i, angle_o = dr.atan2(across_i, wi.z), dr.atan2(across_o, wo.z)
        tilt = (math.pi + angle_i - angle_o) / 4
        sin, cos = dr.sincos(tilt)
        m = type(wi)(sin * cos_phi, sin * sin_phi, cos)
        lit, seen = Facet.met(wi, m), Facet.met(wo, opposite(m))
        part, _ = mirrored_part(wi, m, lit, seen)
        pole = dr.maximum(dr.abs(dr.sin((angle_i + angle_o) / 2)), POLE)
        length = dr.sqrt(dr.maximum(1 - dr.square(along), TINY))
        both = distribution.density(m) * part / (8 * wi.z * length * pole)
        value = value + both * (1 - transmittance(lit.cos, eta)) * (1 - transmittance(seen.cos, eta))
        density = density + both
    return value, density
