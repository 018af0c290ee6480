"""Light through a microgeometry: all paths of a batch in one kernel."""

from __future__ import annotations

from typing import NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from .microgeometry import Piece, Rays
from .sensors import Points, Sensor
from .tile import VISIBLE, opaque

UNIT = 2.0**-30
"""Energy is counted in whole units of this: integers add up to the same sum in any order, floats do not."""
ELSEWHERE, BELOW, CUT = range(3)
"""Counted after the sensor's cells: light that misses them, that leaves downwards, and that is not followed further."""
EXTRA = 3
STEPS = 100_000
"""A ray that has met so many facets and walls is given up: it runs along the surface, or slips through it."""
DARK = 0.1
"""Paths with less than this left play Russian roulette."""


class Settings(NamedTuple):
    """How far paths are followed, and what is told apart."""

    limit: int  # scatterings after which a path is given up
    orders: int  # how many orders are counted apart; the last one takes all that follow
    wavelengths: tuple[float, ...] = ()  # nm, in spectral variants; `VISIBLE` if none


def generator(seed: np.random.SeedSequence, lanes: int) -> tuple[mi.PCG32, mi.Point2f]:
    """Random numbers for each lane, and a random point of the unit square for all of them."""
    state, stream, *corner = (int(word) for word in seed.generate_state(4))
    lane = dr.arange(mi.UInt32, lanes) ^ dr.opaque(mi.UInt32, state)
    rng = mi.PCG32(lanes, *mi.sample_tea_32(lane, dr.opaque(mi.UInt32, stream)))
    return rng, opaque(mi.Point2f, *(word / 2**32 for word in corner))


@dr.syntax
def visible(rays: Rays, rng: mi.PCG32, o: mi.Point3f, d: mi.Vector3f, active: mi.Bool) -> mi.Bool:
    """Whether nothing is in the way from ``o`` along ``d`` to the top."""
    rng = mi.PCG32(rng)  # what follows may use the same numbers: no sum of light is wrong for it
    o, seen, active, steps = mi.Point3f(o), mi.Bool(active), mi.Bool(active), mi.UInt32(0)
    while active:
        step = rays.step(rng, o, d, active)
        seen &= ~step.hit
        active &= ~step.hit & ~step.left & (steps < STEPS)
        o = step.onwards
        steps += 1
    return seen & (steps < STEPS)


@dr.syntax
def trace(
    piece: Piece, sensor: Sensor, wi: np.ndarray, settings: Settings, seed: np.random.SeedSequence, lanes: int
) -> np.ndarray:
    """Shoot ``lanes`` paths from ``wi``; return their energy in units: (orders, cells + EXTRA, channels)."""
    rays = piece.rays(settings.wavelengths or VISIBLE)
    ctx = mi.BSDFContext(mi.TransportMode.Importance)  # energy; radiance would change by eta² at every refraction
    rng, corner = generator(seed, lanes)
    frame = mi.Frame3f(*(opaque(mi.Vector3f, *axis) for axis in sensor.axes(wi)))
    # A sensor itself must not become a variable of the loop.
    locate, cells, aimed = sensor.locate, sensor.cells, isinstance(sensor, Points)
    channels, columns = dr.size_v(mi.UnpolarizedSpectrum), cells + EXTRA
    energy = dr.zeros(mi.UInt64, settings.orders * columns * channels)

    def count(order, column, value, active):
        row = dr.minimum(dr.maximum(order, 1), settings.orders) - 1
        for channel in range(channels):
            units = mi.UInt64(value[channel] / UNIT + 0.5)
            dr.scatter_reduce(dr.ReduceOp.Add, energy, units, (row * columns + column) * channels + channel, active)

    o, d = rays.enter(rng, corner, lanes), -opaque(mi.Vector3f, *wi)
    if dr.hint(aimed, mode="scalar"):
        target = dr.arange(mi.UInt32, lanes) % cells
        to = dr.gather(mi.Vector3f, mi.Vector3f(sensor.directions(wi)[:, 0].T), target)
    weight, order, steps, active = mi.UnpolarizedSpectrum(1), mi.UInt32(0), mi.UInt32(0), mi.Bool(True)
    while active:
        step = rays.step(rng, o, d, active)
        si, bsdf = step.si, step.bsdf
        lost = ~step.left & ((step.hit & (order == settings.limit)) | (steps == STEPS))
        scattered = step.hit & ~lost

        cell, inside = locate(frame.to_local(d))
        column = dr.select(d.z < 0, cells + BELOW, dr.select(inside, cell, cells + ELSEWHERE))
        count(order, column, weight, step.left)
        count(order, cells + CUT, weight, lost)
        if dr.hint(aimed, mode="scalar"):
            value = mi.unpolarized_spectrum(bsdf.eval(ctx, si, si.to_local(to), scattered))
            lit = scattered & dr.any(value > 0)
            count(order + 1, target, weight * value, visible(rays, rng, rays.leave(si, to), to, lit))

        bs, share = bsdf.sample(
            ctx, si, rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32()), scattered
        )
        weight = dr.select(scattered, weight * mi.unpolarized_spectrum(share), weight)
        d = dr.select(scattered, si.to_world(bs.wo), d)
        o = dr.select(scattered, rays.leave(si, d), step.onwards)
        order += dr.select(scattered, mi.UInt32(1), 0)
        strength = dr.max(weight)
        survival = dr.minimum(strength / DARK, 1)
        active &= ~step.left & ~lost & (rng.next_float32() < survival)
        steps += 1
        weight /= dr.maximum(survival, 1e-20)
    return np.array(energy).reshape(settings.orders, columns, channels)
