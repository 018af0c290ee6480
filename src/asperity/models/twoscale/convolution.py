"""The convolution of a distribution of facets with what each diffracts, by quadrature that knows where both have peaks.

    V = int (1 + 4 u^2 (1 - (h.m)^2))^(-(c + 1) / 2) (h.m)^2 D(m) dm over the hemisphere, with h.m > 0,

and (S * D)(h) is V times `diffraction.scale`. Nodes are at azimuths of m around that of h, and at each along a meridian
of tilts. Between two peaks or edges they are dense at both ends: in either half of such an interval, Gauss nodes are
those of an argument of sinh.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr

from ...microfacet.epd import Profile
from ...microfacet.numerics import normalised
from ...microfacet.quadrature import Lanes, integrate
from .diffraction import spread

NODES = 8
"""In azimuth and tilt, for each half interval: 1e-4."""
FEWEST = 30
"""Beyond slopes where facets are e^-30 times as many, there are none."""


def convolution(profile: Profile, alpha: Any, c: Any, u: Any, sin: Any, cos: Any, nodes: int = NODES) -> Any:
    """V for the tilt of h with this sine and cosine, of facets alike around the normal."""
    lanes = Lanes(u, nodes, 2)
    u, sin, cos = (lanes.repeat(x) for x in (u, sin, cos))
    parts = [Part.of(peak, 1, dr.pi / 2) for peak in (Peak(0, 1, 0, nearby(u, sin)), Peak(1, 0, dr.pi / 2, 2))]
    sin_phi, cos_phi, derivative = map(lanes.pick, zip(*(part.node(lanes.node) for part in parts)))
    return lanes.sum(2 * derivative * along_meridian(profile, alpha, c, u, sin, cos, sin_phi, cos_phi, nodes))


def stretched_convolution(
    profile: Profile,
    alpha: tuple[Any, Any],
    c: Any,
    u: Any,
    sin: Any,
    cos: Any,
    azimuth: Any,
    nodes: int = NODES,
) -> Any:
    """V of a distribution with two roughnesses, of which the first is larger.

    ``azimuth`` in [0, pi/2] is that of h, from the axis of the first.
    """
    lanes = Lanes(u, nodes, 10)
    u, sin, cos, azimuth = (lanes.repeat(x) for x in (u, sin, cos, azimuth))
    axis, near = dr.clip(dr.detach(alpha[1] / alpha[0]), 1e-2, 1), nearby(u, sin)
    # Half turns, of which D knows nothing, begin and end at the axis; in between are h, and where m turns away from it.
    begin, peak, end = Peak(0, 1, 0, axis), Peak.at(azimuth, near), Peak(0, -1, dr.pi, axis)
    across = Peak(peak.cos, -peak.sin, azimuth + dr.pi / 2, 2)
    parts = Part.halves(begin, peak) + Part.halves(peak, across) + [Part.of(end, -1, dr.pi / 2 - azimuth)]
    sin_a, cos_a, derivative = (lanes.pick(options * 2) for options in zip(*(part.node(lanes.node) for part in parts)))
    turned = lanes.pick([1] * 5 + [-1] * 5)
    sin_phi = turned * (sin_a * peak.cos - cos_a * peak.sin)
    cos_phi = turned * (cos_a * peak.cos + sin_a * peak.sin)
    square = dr.rcp(dr.square(cos_a / alpha[0]) + dr.square(sin_a / alpha[1]))
    found = along_meridian(profile, dr.sqrt(square), c, u, sin, cos, sin_phi, cos_phi, nodes)
    return lanes.sum(derivative * found * square / (alpha[0] * alpha[1]))


def nearby(u: Any, sin: Any) -> Any:
    """Azimuth from h up to which S is large; as all that nodes depend on, without derivatives."""
    return dr.clip(0.5 / dr.detach(u * dr.maximum(sin, 1e-6)), 1e-3, 2)


def along_meridian(
    profile: Profile, alpha: Any, c: Any, u: Any, sin: Any, cos: Any, sin_phi: Any, cos_phi: Any, nodes: int
) -> Any:
    """Integral of S D over the normals m at one azimuth."""
    parts = tilt_parts(*map(dr.detach, (profile.p, alpha, u, sin, cos, sin_phi, cos_phi)))
    meridian = Meridian(profile, alpha, c, u, sin, cos, sin_phi, cos_phi, parts)
    return integrate(lambda t, meridian: (meridian(t),), nodes, meridian, u)[0]


@dataclass
class Meridian:
    """Normals m at one azimuth, and what S D is made of there; h is at the azimuth 0."""

    profile: Profile
    alpha: Any  # of D along the azimuth
    c: Any
    u: Any
    sin: Any  # of h
    cos: Any
    sin_phi: Any  # of m
    cos_phi: Any
    parts: list[Part]

    def __call__(self, t: Any) -> Any:
        """Integrand over the tilts, of all parts at the node ``t``."""
        return sum(self.integrand(*part.node(t)) for part in self.parts)

    def integrand(self, sin: Any, cos: Any, derivative: Any) -> Any:
        """At a tilt; with |h x m| as the root of two squares, 1 - (h.m)^2 keeps its digits."""
        facing = self.cos * cos + self.sin * sin * self.cos_phi
        off = dr.square(self.sin * self.sin_phi) + dr.square(sin * self.cos - cos * self.sin * self.cos_phi)
        diffracted = spread(4 * dr.square(self.u) * off, self.c) * dr.square(dr.maximum(facing, 0))
        return diffracted * self.profile.density_of_tilts(self.alpha, sin, cos) * sin * derivative


def tilt_parts(p: Any, alpha: Any, u: Any, sin: Any, cos: Any, sin_phi: Any, cos_phi: Any) -> list[Part]:
    """Intervals of tilts along a meridian, between all that has a peak or an edge.

    These are the normal, where D begins; the tilt of D's edge; the tilt nearest to h, which S is around; and the end:
    the horizon, or where m turns away from h, or beyond all facets.
    """
    ahead, cos = cos_phi > 0, dr.maximum(cos, 1e-7)
    sin_end, cos_end = normalised(dr.select(ahead, 1, cos), dr.select(ahead, 0, -sin * cos_phi))
    gentlest = dr.rcp(alpha * dr.exp(dr.log(FEWEST) / (2 * p)))  # cotangent of the slope beyond which D < e^-FEWEST
    steep = cos_end < gentlest * sin_end
    sin_end, cos_end = (dr.select(steep, *pair) for pair in zip(normalised(1, gentlest), (sin_end, cos_end)))
    end = Peak(sin_end, cos_end, dr.atan2(sin_end, cos_end), dr.clip(cos_end, 1e-4, 1))
    nearest = dr.minimum(dr.atan2(sin * dr.maximum(cos_phi, 0), cos), end.angle)
    edge = dr.minimum(dr.atan(alpha), end.angle)
    away = sin * dr.select(ahead, dr.abs(sin_phi), 1)
    width, narrow = dr.clip(dr.sqrt(dr.square(0.5 / u) + dr.square(away)), 1e-4, 1), dr.maximum(edge / (1 + p), 1e-5)
    first = nearest < edge
    low = Peak.at(dr.minimum(nearest, edge), dr.select(first, width, narrow))
    high = Peak.at(dr.maximum(nearest, edge), dr.select(first, narrow, width))
    begin = Peak(0, 1, 0, dr.clip(edge, 1e-5, width))
    return Part.halves(begin, low) + Part.halves(low, high) + Part.halves(high, end)


@dataclass
class Peak:
    """An end of an interval of angles, next to which nodes are dense: at distances ``width`` sinh(...)."""

    sin: Any
    cos: Any
    angle: Any
    width: Any

    @classmethod
    def at(cls, angle: Any, width: Any) -> Peak:
        """That at this angle."""
        sin, cos = dr.sincos(angle)
        return cls(sin, cos, angle, width)


@dataclass
class Part:
    """A part of an interval, from its end ``peak`` upwards or, with the ``sign`` -1, downwards."""

    peak: Peak
    sign: float
    extent: Any  # of the argument of sinh

    @classmethod
    def of(cls, peak: Peak, sign: float, length: Any) -> Part:
        """That of this length."""
        return cls(peak, sign, dr.asinh(length / peak.width))

    @classmethod
    def halves(cls, low: Peak, high: Peak) -> list[Part]:
        """The interval between two angles."""
        half = dr.maximum(high.angle - low.angle, 0) / 2
        return [cls.of(low, 1, half), cls.of(high, -1, half)]

    def node(self, t: Any) -> tuple[Any, Any, Any]:
        """(sine, cosine, derivative) of the angle, for ``t`` in [0, 1]."""
        argument = self.extent * t
        sin, cos = dr.sincos(self.peak.width * dr.sinh(argument))
        sin = self.sign * sin
        across, along = self.peak.sin * cos + self.peak.cos * sin, self.peak.cos * cos - self.peak.sin * sin
        return across, along, self.extent * self.peak.width * dr.cosh(argument)
