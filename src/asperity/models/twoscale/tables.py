"""What is tabulated for a material, because it is too dear for every ray; differentiable throughout."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import prod
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ...microfacet.epd import Power, Profile
from ...microfacet.ggx import inclination
from ...microfacet.numerics import clamp, heading, log1p, one_minus_exp
from ...microfacet.tables import Table, array_types, native
from .convolution import convolution, stretched_convolution
from .diffraction import propagating, smooth_albedo, spread

VISIBLE = 0.36, 0.83
"""Ends of the wavelengths that Mitsuba samples, in micrometres."""
COSINES, COLOURS = 64, 32
"""Nodes of R, over cos_d; and in spectral variants, over wavelengths."""
LOST = (24, 24), 6
"""The same of what smooth facets lose, over the phase and cos_d."""
EVEN, STRETCHED = (28, 108), (17, 14, 56)
"""Nodes of the convolution over u and the tilt of h; of two roughnesses, over the azimuth of h first."""


@dataclass
class Bands:
    """Wavelengths in micrometres: one of each channel, or in spectral variants all that can be sampled."""

    channels: tuple[float, ...] | None

    @classmethod
    def of(cls, channels: Sequence[float]) -> Bands:
        """For the active variant, those of the three ``channels`` that it has."""
        if mi.is_spectral:
            return cls(None)
        return cls(tuple(channels) if dr.size_v(mi.UnpolarizedSpectrum) == 3 else (channels[1],))

    @property
    def shortest(self) -> float:
        """The least of them."""
        return min(self.channels or VISIBLE)

    @property
    def typical(self) -> float:
        """One in the middle."""
        channels = sorted(self.channels or (*VISIBLE, 0.55))
        return channels[len(channels) // 2]

    @property
    def ratios(self) -> list[float]:
        """The shortest over each channel's: of their frequencies u to the highest; 1 where u is any."""
        return [self.shortest / channel for channel in self.channels or [self.shortest]]

    def at(self, si: Any) -> Any:
        """Those of a ray, as a spectrum."""
        if self.channels is None:
            return clamp(mi.UnpolarizedSpectrum(si.wavelengths) * 1e-3, *VISIBLE)
        return mi.UnpolarizedSpectrum(*self.channels)

    def tabulate(self, f: Callable, Float: Any, axes: Sequence[int], colours: int) -> ByWavelength:
        """A function ``f(index, wavelength, *x)`` of numbers x in [0, 1]; ``index`` is that of the channel."""
        if self.channels is not None:
            nodes = grid(Float, axes)
            return ByWavelength(packed(axes, [f(n, Float(one), *nodes) for n, one in enumerate(self.channels)]), None)
        axes, (low, high) = [*axes, colours], VISIBLE
        *nodes, colour = grid(Float, axes)
        return ByWavelength(Table.of(axes, [f(0, low * dr.exp(colour * math.log(high / low)), *nodes)]), VISIBLE)


def grid(Float: Any, axes: Sequence[int]) -> list[Any]:
    """Coordinates in [0, 1] of all nodes of a table."""
    nodes = np.meshgrid(*(np.linspace(0, 1, count) for count in axes), indexing="ij")
    return [Float(x.ravel().astype(np.float32)) for x in nodes]


def packed(axes: Sequence[int], channels: list[Any]) -> Table:
    """A table of one channel or of three, which with a fourth are read at once."""
    return Table.of(axes, channels + channels[:1] * (len(channels) == 3))


@dataclass
class ByWavelength:
    """A tabulated function of numbers in [0, 1] and the wavelength: the channel, or the last axis."""

    table: Table
    ends: tuple[float, float] | None  # of that axis

    def native(self) -> ByWavelength:
        """The same for the active variant."""
        return replace(self, table=self.table.native())

    def one(self, index: int, wavelength: Any, *x: Any) -> Any:
        """Its value at a wavelength, that of the channel ``index``."""
        if self.ends is None:
            return self.table.at(*x)[index]
        low, high = self.ends
        return self.table.at(*x, dr.log(wavelength / low) / math.log(high / low))[0]

    def at(self, wavelengths: Any, *x: Any) -> Any:
        """Its values at the wavelengths of a spectrum."""
        if self.ends is None:
            return type(wavelengths)(self.table.at(*x)[: len(wavelengths)])
        return type(wavelengths)([self.one(n, wavelength, *x) for n, wavelength in enumerate(wavelengths)])


@dataclass
class Layout:
    """Where nodes are of a function of u, up to ``highest``, and of the tilt of h.

    They move with the parameters and carry derivatives, which are then those of the table as it is, errors included.
    """

    highest: Any
    near: Any  # how near to the normal, and to the horizon, nodes become dense: in tangents of half the tilt
    low: Any

    @classmethod
    def of(cls, alpha: Any, highest: Any, flat: Any) -> Layout:
        """For the smaller roughness, the highest frequency, and a quarter of the variance of slopes."""
        near = 0.3 * dr.sqrt(dr.square(dr.minimum(alpha, 0.04)) + dr.square(0.5 / highest))
        return cls(highest, dr.minimum(near, 0.25), dr.clip(3 * dr.sqrt(flat), 0.005, 0.09))

    def native(self) -> Layout:
        """The same for the active variant."""
        return Layout(*map(native, (self.highest, self.near, self.low)))

    def u(self, x: Any) -> Any:
        """The frequency at the coordinate ``x``; a little more than 0, which would be no wave."""
        x = dr.exp(dr.maximum(x, 1e-4) * dr.asinh(2 * self.highest))
        return (x - 1 / x) / 4

    def of_u(self, u: Any) -> Any:
        """The coordinate in [0, 1] of a frequency."""
        return dr.asinh(2 * u) / dr.asinh(2 * self.highest)

    def tilt(self, x: Any) -> tuple[Any, Any]:
        """(sine, cosine) of the tilt at the coordinate ``x``."""
        ratio = dr.exp(x * self._extent()) * self.near
        tangent = dr.clip((ratio - self.near) * (1 + self.low) / (1 + self.low + ratio), 0, 1)
        square = dr.square(tangent)
        return 2 * tangent / (1 + square), (1 - square) / (1 + square)

    def of_tilt(self, tangent: Any) -> Any:
        """The coordinate in [0, 1], of the tangent of half the tilt: dense at both ends."""
        return dr.log((1 + tangent / self.near) / (1 - tangent / (1 + self.low))) / self._extent()

    def _extent(self) -> Any:
        return dr.log((1 + 1 / self.near) / (1 - 1 / (1 + self.low)))


@dataclass
class Convolved:
    """log V, but for the power spectrum at h and the facets' variance, which V is near (see `convolution`)."""

    table: Table
    layout: Layout
    ratios: list[float]  # of the channels' u to the highest, of which all are read at once
    flat: tuple[Any, Any]  # quarters of the variance of slopes across and along the larger roughness, at most .075
    turned: Any  # of two roughnesses: 0 if that along x is larger, or else 1

    @classmethod
    def of(cls, profile: Profile, alpha: Sequence[Any], b: Any, c: Any, bands: Bands) -> Convolved:
        """For one roughness or two."""
        Float, larger, smaller = type(b), dr.maximum(alpha[0], alpha[-1]), dr.minimum(alpha[0], alpha[-1])
        across, along = (dr.minimum(dr.square(one) * profile.variance(), 0.3) / 4 for one in (smaller, larger))
        layout = Layout.of(smaller, b / bands.shortest, across)
        axes, ratios = (EVEN, bands.ratios) if len(alpha) == 1 else (STRETCHED, [1.0])
        *azimuth, frequency, tilt = (dr.repeat(x, len(ratios)) for x in grid(Float, axes))
        (sin, cos), u = layout.tilt(tilt), layout.u(frequency) * dr.tile(Float(ratios), prod(axes))
        if azimuth:
            turn = dr.acos(dr.sqrt(azimuth[0]))
            V = stretched_convolution(profile, (larger, smaller), c, u, sin, cos, turn)
        else:
            V = convolution(profile, larger, c, u, sin, cos)
        found, UInt = dr.log(V / like(c, u, sin, cos, between((across, along), azimuth))), dr.uint32_array_t(Float)
        nodes = len(ratios) * dr.arange(UInt, prod(axes))
        table = packed(axes, [dr.gather(Float, found, nodes + n) for n in range(len(ratios))])
        turned = dr.select(dr.detach(alpha[0] >= alpha[-1]), Float(0), Float(1))
        return cls(table, layout, ratios, (across, along), turned)

    def native(self) -> Convolved:
        """The same for the active variant."""
        across, along = map(native, self.flat)
        return Convolved(self.table.native(), self.layout.native(), self.ratios, (across, along), native(self.turned))

    def at(self, c: Any, u: Any, h: Any) -> Any:
        """V of a spectrum of frequencies ``u``: those of the channels, or any."""
        sin, cos = inclination(h)
        along, tilt = [], self.layout.of_tilt(sin / (1 + cos))
        if len(self.table.shape) == 3:
            x, y = heading(h.x, h.y)
            along = [dr.lerp(dr.square(x), dr.square(y), self.turned)]
        if len(self.ratios) == 1:
            found = [self.table.at(*along, self.layout.of_u(one), tilt)[0] for one in u]
        else:
            found = self.table.at(self.layout.of_u(u[self.ratios.index(1)]), tilt)[: len(u)]
        return dr.exp(type(u)(found)) * like(c, u, sin, cos, between(self.flat, along))


def between(flat: tuple[Any, Any], along: list[Any]) -> Any:
    """The variance at an azimuth, by the squared cosine between it and the larger roughness; of one, any."""
    return dr.lerp(*flat, along[0]) if along else flat[0]


def like(c: Any, u: Any, sin: Any, cos: Any, flat: Any) -> Any:
    """A function that V is near, for the tilt of h with this sine and cosine.

    S at h, of the facets that face it: at the horizon they are a half, and (h.m)^2 varies by what their slopes do.
    """
    facing = (cos + dr.sqrt(dr.square(cos) + 4 * flat)) / 2
    return spread(4 * dr.square(u * sin), c) * dr.square(facing)


def lost(b: Any, c: Any, bands: Bands, R: ByWavelength) -> ByWavelength:
    """E: exp(-k^2 E) is what a smooth facet keeps in the mirror direction, if all it diffracts is taken from there.

    Over k / (1 + k), with the deviation k = 4 pi sigma / lambda of the phase at normal incidence, and cos_d.
    """

    def exponent(index: int, wavelength: Any, x: Any, cos: Any) -> Any:
        x, cos = dr.clip(x, 0.01, 0.99), dr.maximum(cos, 1e-3)
        k2 = dr.square(x / (1 - x))
        wavelength = wavelength + 0 * cos

        def share(cos_d: Any, k2: Any, wavelength: Any) -> Any:
            fraction = R.one(index, wavelength, cos_d)
            return one_minus_exp(k2 * dr.square(cos_d) * fraction) / fraction

        T = smooth_albedo(share, dr.sqrt(1 - cos * cos), cos, b / wavelength, c, (k2, wavelength))
        return -log1p(-dr.minimum(T, 1 - 1e-6)) / k2

    return bands.tabulate(exponent, type(b), *LOST)


@dataclass
class Known:
    """All that is made from constants."""

    bands: Bands
    power: Power
    R: ByWavelength
    convolved: Convolved
    median: Any  # slope of facets, over the roughness
    lost: ByWavelength | None = None  # if energy is conserved

    @classmethod
    def made(cls, bands: Bands, conserving: bool, *constants: Any) -> Known:
        """For the active variant: of p, b, c, and one roughness, or those along x and y."""
        Float, _ = array_types("alpha")
        p, b, c, *alpha = numbers = [Float(constant) for constant in constants]
        dr.make_opaque(numbers)  # else every other number compiles anew
        power = Power.of(p)

        def share(index: int, wavelength: Any, cos: Any) -> Any:
            return propagating(dr.sqrt(1 - cos * cos), b / wavelength, c)

        R = bands.tabulate(share, Float, [COSINES], COLOURS)
        median = dr.sqrt(power.sample(Float(0.5)))
        known = cls(bands, power, R, Convolved.of(power.profile, alpha, b, c, bands), median)
        if conserving:
            known.lost = lost(b, c, bands, R)
        return known.native()

    def native(self) -> Known:
        """The same for the active variant."""
        parts = {name: part.native() for name, part in vars(self).items() if hasattr(part, "native")}
        return replace(self, **parts, median=native(self.median))
