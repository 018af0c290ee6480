"""Light that meets more than two facets of V-cavities: what is missing after two, spread so that it is reciprocal.

With eps(i) = 1 - the albedo of one bounce and two, if the body absorbs nothing, and its hemispherical mean,

    f of more = r(Q) eps(i) eps(o) / (pi eps_mean)

is reciprocal, and closes the white furnace; r is the share of it that is left if the body does absorb, `more_bounces`.
Symbols are those of `interreflection`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import numpy as np

from ...microfacet.distributions import Distribution
from ...microfacet.masking import cavity_visible_and_lit
from ...microfacet.numerics import heading
from ...microfacet.quadrature import gauss_legendre, integrate, over_normals
from ...microfacet.sampling import reflect
from ...microfacet.tables import Table
from .body import GRAZING, body_albedo, fresnel, outer_reflectance, transmitted
from .interreflection import OUT_OF_PLANE, TILTS, TINY, Met, mirrored_part, opposite

COSINES, AZIMUTHS, SHADES = 48, 7, 33
"""Nodes of the tables of `More`: in the root of the cosine and in the azimuth of the first quadrant, and in Q."""
ALBEDO = 24, 24
"""Cosines and azimuths of the integral over a hemisphere."""


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
    ) -> More:
        """For constants, arrays of one number; ``body(wi, wo)`` is f, without what is mirrored only, if Q is Q_1.

        If the constants have derivatives, so do the tables.
        """
        Float = type(n)
        azimuths = 1 if isotropic else AZIMUTHS
        root, azimuth = np.meshgrid(np.linspace(0, 1, COSINES), np.linspace(0, 0.5, azimuths), indexing="ij")
        cos = np.maximum(root.ravel() ** 2, GRAZING)
        sin = np.sqrt(1 - cos * cos)
        turns = azimuth.ravel() * np.pi
        wi = Vector(*(Float(x.astype(np.float32)) for x in (sin * np.cos(turns), sin * np.sin(turns), cos)))
        white = body_albedo(1, n)
        returned = mirrored_albedo(distribution, n, wi) + body_share(body, wi, *ALBEDO)
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
