"""Light that the finer roughness diffracts on a facet.

It has the rms height sigma_s and the power spectrum of K-correlation, with the correlation length b and the exponent
c > 1 (generalised Harvey and Shack's theory). All depends on the cosine cos_d between either direction and
the half vector h, on h, and on the wavelength lambda, by B = b / lambda. Lengths are in micrometres, equations those of
Holzschuch and Pacanowski 2017; what the paper leaves open is settled in docs/papers/twoscale.md.

A facet m keeps A of the light in the mirror direction, and spreads 1 - A around it by

    S(h.m) = B^2 (c - 1) / (2 pi R) (1 + 4 u^2 (1 - (h.m)^2))^(-(c + 1) / 2) (h.m)^2 per steradian,   u = B cos_d.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr

from ...microfacet.numerics import ONE_BELOW, log1p, one_minus_exp
from ...microfacet.quadrature import Lanes, accumulate

MIDPOINTS = 256
"""Of the integral R: 1e-4 at grazing incidence, where it converges last."""


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
    """Share of the power spectrum at frequencies below ``radius`` / b, in waves per length: an integral in 2D."""
    return one_minus_exp((c - 1) / 2 * log1p(dr.square(radius)))


def scale(B: Any, c: Any, R: Any) -> Any:
    """B^2 (c - 1) / (2 pi R), which normalises S."""
    return dr.square(B) * (c - 1) / (2 * dr.pi * R)


def spread(square: Any, c: Any) -> Any:
    """(1 + square)^(-(c + 1) / 2), the power spectrum's shape, at the square of b times a frequency."""
    return dr.exp(-(c + 1) / 2 * dr.log(1 + square))


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
        share = dr.minimum(u * self.total(), ONE_BELOW)
        depth = -2 / (self.c - 1) * log1p(-share)  # log(1 + B^2 r^2)
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


def smooth_albedo(
    share: Callable, sin: Any, cos: Any, B: Any, c: Any, others: Sequence[Any] = (), rule: tuple[int, int] = (16, 16)
) -> Any:
    """T: what a smooth facet diffracts of the light from this inclination, without Fresnel's term.

    ``share(cos_d, *others)`` is (1 - A) / R. Nodes are where the power spectrum is, around the mirror direction.
    """
    radii = Lanes(sin, rule[0], 2)
    sin, cos, B, *others = (radii.repeat(x) for x in (sin, cos, B, *others))
    disc = Disc(sin, dr.detach(B), dr.detach(c))
    whole = within(disc.B * (1 - sin), disc.c) / disc.total()  # share whose circles are within the disc
    t, beyond = radii.node, 1 - whole  # the azimuths of other circles have roots at both ends
    r = disc.radius(radii.pick([whole * t, whole + beyond * t * t * (3 - 2 * t)]))
    drawn = scale(B, c, 1) * spread(dr.square(B * r), c) / disc.density(r)
    drawn = drawn * radii.pick([whole, beyond * 6 * t * (1 - t)])
    lanes = Lanes(r, rule[1])
    reach, drawn, r, sin, cos, *others = (lanes.repeat(x) for x in (disc.reach(r), drawn, r, sin, cos, *others))
    sin_psi, cos_psi = dr.sincos(lanes.node * reach)
    up = cos + dr.sqrt(dr.maximum(1 - dr.square(r * cos_psi - sin) - dr.square(r * sin_psi), 0))
    square = (dr.square(r) + dr.square(up)) / 4  # cos_d^2, of which (h.n)^2 is the part up^2 / 4
    return radii.sum(lanes.sum(share(dr.sqrt(square), *others) * drawn * dr.square(up) / (4 * square)))
