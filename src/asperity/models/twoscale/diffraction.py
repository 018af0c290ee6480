"""Light that the small scale of roughness diffracts: on a smooth facet, and on all facets together.

The small scale has the rms height sigma_s and the power spectrum of K-correlation, with the correlation length b and
the exponent c > 1 (generalised Harvey and Shack's theory). All depends on the cosine cos_d between either direction and
the half vector h, on h, and on the wavelength lambda, by B = b / lambda. Lengths are in micrometres, equations those of
Holzschuch and Pacanowski 2017; what the paper leaves open is settled in docs/twoscale.md.

A facet m keeps A of the light in the mirror direction, and spreads 1 - A around it by

    S(h.m) = B^2 (c - 1) / (2 pi R) (1 + 4 u^2 (1 - (h.m)^2))^(-(c + 1) / 2) (h.m)^2 per steradian,   u = B cos_d.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr

from ...microfacet.epd import Profile
from ...microfacet.numerics import log1p, normalised, one_minus_exp
from ...microfacet.quadrature import accumulate, gauss_legendre, integrate

MIDPOINTS = 256
"""Of the integral R: 1e-4 at grazing incidence, where it converges last."""
NODES = 8
"""Of the convolution, in azimuth and tilt, for each part that begins or ends at a peak: 1e-4."""
FEWEST = 30
"""Beyond slopes where facets are e^-30 times as many, there are none."""


def phase(sigma: Any, cos_d: Any, wavelength: Any) -> Any:
    """(4 pi sigma cos_d / lambda)^2: variance of the phase of light that is mirrored by heights of deviation sigma."""
    return dr.square(4 * dr.pi * sigma * cos_d / wavelength)


def propagating(sin: Any, B: Any, c: Any) -> Any:
    """R in (0, 1): share of the power spectrum that turns light of this sine of incidence to real directions (Eq. 19).

    The disc of directions is seen from the mirror direction, with its rim at the distance r of azimuth phi.
    """
    Float = type(sin + B + c)
    sin, B, c = Float(sin), Float(B), Float(c)

    def ray(index: Any, captured: tuple) -> tuple[Any]:
        sin, B, c = captured
        sin_phi, cos_phi = dr.sincos((Float(index) + 0.5) * (dr.pi / MIDPOINTS))
        r = dr.sqrt(dr.maximum(1 - dr.square(sin * sin_phi), 0)) - sin * cos_phi
        return (within(B * r, c) / MIDPOINTS,)

    (share,) = accumulate(ray, dr.uint32_array_t(Float)(MIDPOINTS), (dr.zeros(Float, dr.width(sin + B)),), (sin, B, c))
    return share


def within(radius: Any, c: Any) -> Any:
    """Share of the power spectrum at frequencies below ``radius`` / (2 pi b): a two-dimensional integral."""
    return one_minus_exp((c - 1) / 2 * log1p(dr.square(radius)))


def scale(B: Any, c: Any, R: Any) -> Any:
    """B^2 (c - 1) / (2 pi R), which normalises S."""
    return dr.square(B) * (c - 1) / (2 * dr.pi * R)


def spread(square: Any, c: Any) -> Any:
    """(1 + square)^(-(c + 1) / 2), the power spectrum's shape, at the square of b times a frequency."""
    return dr.exp(-(c + 1) / 2 * dr.log(1 + square))


@dataclass
class Peak:
    """An end of an interval of tilts, next to which nodes are dense: at distances ``width`` sinh(...)."""

    sin: Any
    cos: Any
    angle: Any
    width: Any

    @classmethod
    def at(cls, angle: Any, width: Any) -> Peak:
        """The tilt ``angle``."""
        sin, cos = dr.sincos(angle)
        return cls(sin, cos, angle, width)


@dataclass
class Part:
    """Half an interval, from its end ``sign`` upwards or downwards."""

    peak: Peak
    sign: float
    extent: Any  # of the argument of sinh

    @classmethod
    def of(cls, peak: Peak, sign: float, length: Any) -> Part:
        """That of this length."""
        return cls(peak, sign, asinh(length / peak.width))

    @classmethod
    def halves(cls, low: Peak, high: Peak) -> list[Part]:
        """The interval between two angles."""
        half = dr.maximum(high.angle - low.angle, 0) / 2
        return [cls.of(low, 1, half), cls.of(high, -1, half)]

    def node(self, t: Any) -> tuple[Any, Any, Any]:
        """(sine, cosine, derivative) of the tilt, for ``t`` in [0, 1]."""
        argument = self.extent * t
        forth, back = dr.exp(argument), dr.exp(-argument)
        sin, cos = dr.sincos(self.peak.width * (forth - back) / 2)
        sin = self.sign * sin
        across, along = self.peak.sin * cos + self.peak.cos * sin, self.peak.cos * cos - self.peak.sin * sin
        return across, along, self.extent * self.peak.width * (forth + back) / 2


def asinh(x: Any) -> Any:
    """The area hyperbolic sine of x >= 0."""
    return dr.log(x + dr.sqrt(x * x + 1))


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


def convolution(profile: Profile, alpha: Any, c: Any, u: Any, sin: Any, cos: Any, nodes: int = NODES) -> Any:
    """V = int (1 + 4 u^2 (1 - (h.m)^2))^(-(c + 1) / 2) (h.m)^2 D(m) dm over the hemisphere, with h.m > 0.

    For the tilt of h with this sine and cosine; ``scale`` V is (S * D)(h).
    """
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
    """Azimuth from h up to which S is large."""
    return dr.clip(0.5 / (u * dr.maximum(sin, 1e-6)), 1e-3, 2)


@dataclass
class Lanes:
    """All nodes of a rule for all lanes of ``like``, side by side; perhaps of several parts."""

    like: Any
    nodes: int
    parts: int = 1

    def __post_init__(self) -> None:
        Float, self.width = type(self.like), dr.width(self.like)
        self.node, self.weight = (
            dr.tile(Float(values), self.width * self.parts) for values in gauss_legendre(self.nodes)
        )

    def repeat(self, x: Any) -> Any:
        """The numbers of all lanes, for each node."""
        return dr.repeat(x, self.nodes * self.parts)

    def pick(self, options: Any) -> Any:
        """What belongs to the part."""
        index = dr.arange(dr.uint32_array_t(type(self.like)), self.width * self.parts * self.nodes)
        part, found = index // self.nodes % self.parts, options[0]
        for n, option in enumerate(options[1:], 1):
            found = dr.select(part == n, option, found)
        return found

    def sum(self, values: Any) -> Any:
        """Integral of what has these values at the nodes."""
        return dr.block_sum(values * self.weight, self.nodes * self.parts)


def along_meridian(
    profile: Profile, alpha: Any, c: Any, u: Any, sin: Any, cos: Any, sin_phi: Any, cos_phi: Any, nodes: int
) -> Any:
    """Integral of S D over the normals m at one azimuth."""
    parts = tilt_parts(dr.detach(profile.p), dr.detach(alpha), u, sin, cos, sin_phi, cos_phi)
    meridian = Meridian(profile, alpha, c, u, sin, cos, sin_phi, cos_phi, parts)
    return integrate(lambda t, meridian: (meridian(t),), nodes, meridian, u)[0]


def tilt_parts(p: Any, alpha: Any, u: Any, sin: Any, cos: Any, sin_phi: Any, cos_phi: Any) -> list[Part]:
    """Intervals of tilts along a meridian, between all that has a peak or an edge.

    That are the normal, where D begins; the tilt of D's edge; the tilt nearest to h, which S is around; and the end:
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


def smooth_albedo(
    share: Callable, sin: Any, cos: Any, B: Any, c: Any, others: Sequence[Any] = (), rule: tuple[int, int] = (24, 16)
) -> Any:
    """T: what a smooth facet diffracts of the light from this inclination, without Fresnel's term.

    ``share(cos_d, *others)`` is (1 - A) / R. Nodes are where the power spectrum is, around the mirror direction.
    """
    radii = Lanes(sin, rule[0])
    sin, cos, B, *others = (radii.repeat(x) for x in (sin, cos, B, *others))
    disc = Disc(sin, dr.detach(B), dr.detach(c))
    r = disc.radius(radii.node)
    drawn = scale(B, c, 1) * spread(dr.square(B * r), c) / disc.density(r)
    lanes = Lanes(r, rule[1])
    reach, drawn, r, sin, cos, *others = (lanes.repeat(x) for x in (disc.reach(r), drawn, r, sin, cos, *others))
    sin_psi, cos_psi = dr.sincos(lanes.node * reach)
    up = cos + dr.sqrt(dr.maximum(1 - dr.square(r * cos_psi - sin) - dr.square(r * sin_psi), 0))
    square = (dr.square(r) + dr.square(up)) / 4  # cos_d^2, of which (h.n)^2 is the part up^2 / 4
    return radii.sum(lanes.sum(share(dr.sqrt(square), *others) * drawn * dr.square(up) / (4 * square)))


@dataclass
class Disc:
    """The power spectrum over the disc of directions, |o_xy| < 1, of light from the inclination of this sine."""

    sin: Any
    B: Any
    c: Any

    def total(self) -> Any:
        """Share of it up to the farthest point of the rim."""
        return within(self.B * (1 + self.sin), self.c)

    def radius(self, u: Any) -> Any:
        """Distance from the mirror direction, below which is a share ``u`` in [0, 1) of `total`."""
        depth = -2 / (self.c - 1) * log1p(-u * self.total())  # log(1 + B^2 r^2)
        return dr.sqrt(dr.exp(depth) * one_minus_exp(depth)) / self.B

    def reach(self, r: Any) -> Any:
        """Azimuth up to which the circle of radius r around the mirror direction is within the disc."""
        inside = r <= 1 - self.sin
        cos = (dr.square(r) + dr.square(self.sin) - 1) / dr.maximum(2 * r * self.sin, 1e-12)
        return dr.select(inside, dr.pi, dr.acos(dr.clip(cos, -1, 1)))

    def density(self, r: Any) -> Any:
        """By area at the distance r, of radii as drawn and azimuths evenly within reach."""
        spectrum = scale(self.B, self.c, self.total()) * spread(dr.square(self.B * r), self.c)
        return spectrum * dr.pi / dr.maximum(self.reach(r), 1e-6)
