"""Light through a microgeometry: all paths of a batch in one kernel."""

from __future__ import annotations

from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from .microgeometry import Tile
from .sensors import Points, Sensor

UNIT = 2.0**-30
"""Energy is counted in whole units of this: integers add up to the same sum in any order, floats do not."""
ELSEWHERE, BELOW, CUT = range(3)
"""Counted after the sensor's cells: light that misses them, that leaves downwards, and that is not followed further."""
EXTRA = 3
CLEARANCE = 3e-7
"""Rays leave a facet by this share of the tile's size: ten roundings of float32 at its edge. Albedos err by 2e-5."""
VISIBLE = (440.0, 520.0, 580.0, 650.0)
"""nm, in spectral variants, unless others are asked for."""
STEPS = 100_000
"""A ray that has met so many facets and walls is given up: it runs along the surface, or slips through it."""
DARK = 0.1
"""Paths with less than this left play Russian roulette."""


class Settings(NamedTuple):
    """How far paths are followed, and what is told apart."""

    limit: int  # scatterings after which a path is given up
    orders: int  # how many orders are counted apart; the last one takes all that follow
    wavelengths: tuple[float, ...] = ()  # nm, in spectral variants


class Step(NamedTuple):
    """What happens to a ray in a tile: it hits something, leaves through top or bottom, or else comes to a side."""

    si: Any
    hit: Any
    left: Any
    next: Any  # the same point of the opposite side, if it came to a side


class Box:
    """A tile for rays: what they hit, and the walls about it."""

    def __init__(self, tile: Tile, wavelengths: tuple[float, ...] = VISIBLE):
        self.scene = tile.scene
        self.half = opaque(mi.Point2f, tile.width / 2, tile.depth / 2)
        self.heights = opaque(mi.Point2f, tile.bottom, tile.top)
        self.window = opaque(mi.Point2f, min(tile.window, tile.width), min(tile.window, tile.depth))
        extent = max(tile.width, tile.depth, tile.top - tile.bottom)
        self.clearance = dr.opaque(mi.Float, CLEARANCE * extent)
        self.wavelengths = opaque(mi.Spectrum, *wavelengths) if mi.is_spectral else mi.Color0f()

    def enter(self, rng: mi.PCG32, corner: Any, lanes: int) -> mi.Point3f:
        """Points at the top, uniform over the window, in Z-order: what is near in the array is near on the surface."""
        stride = 2**32 // lanes
        z_order = dr.arange(mi.UInt32, lanes) * stride + rng.next_uint32() % stride
        where = mi.Point2f(*(_every_second_bit(z_order >> k) for k in (0, 1)))
        where = (where + mi.Point2f(rng.next_float32(), rng.next_float32())) / 2**16
        turns = corner + where * self.window / (2 * self.half)
        x, y = ((turns - dr.floor(turns)) * 2 - 1) * self.half
        return mi.Point3f(x, y, self.heights.y)

    def step(self, o: mi.Point3f, d: mi.Vector3f, active: mi.Bool) -> Step:
        """Follow rays to the nearest facet or wall."""
        to_x, to_y = (_distance(dr.copysign(half, w) - p, w) for half, p, w in zip(self.half, o, d))
        to_end = _distance(dr.select(d.z > 0, self.heights.y, self.heights.x) - o.z, d.z)
        to_side = dr.minimum(to_x, to_y)
        nearest = dr.minimum(to_side, to_end)
        ray = mi.Ray3f(o, d, nearest, 0.0, self.wavelengths)
        si = self.scene.ray_intersect(ray, mi.RayFlags.All, False, active)
        hit = active & si.is_valid()
        there = o + d * nearest
        x = dr.select(to_x <= to_y, -dr.copysign(self.half.x, d.x), there.x)
        y = dr.select(to_y <= to_x, -dr.copysign(self.half.y, d.y), there.y)
        return Step(si, hit, active & ~hit & (to_end <= to_side), mi.Point3f(x, y, there.z))

    def leave(self, si: mi.SurfaceInteraction3f, d: mi.Vector3f) -> mi.Point3f:
        """Where a ray along ``d`` starts from a facet."""
        return si.p + si.n * dr.copysign(self.clearance, dr.dot(si.n, d))


def opaque(kind: type, *numbers: float) -> Any:
    """A vector of numbers that are no constants to Dr.Jit: one kernel serves them all."""
    return kind(*(dr.opaque(mi.Float, float(x)) for x in numbers))


def generator(seed: np.random.SeedSequence, lanes: int) -> tuple[mi.PCG32, mi.Point2f]:
    """Random numbers for each lane, and a random point of the unit square for all of them."""
    state, stream, *corner = (int(word) for word in seed.generate_state(4))
    lane = dr.arange(mi.UInt32, lanes) ^ dr.opaque(mi.UInt32, state)
    rng = mi.PCG32(lanes, *mi.sample_tea_32(lane, dr.opaque(mi.UInt32, stream)))
    return rng, opaque(mi.Point2f, *(word / 2**32 for word in corner))


def solid(si: mi.SurfaceInteraction3f, bsdf: Any) -> mi.Bool:
    """Whether a hit counts: the backs of one-sided facets are air.

    Rays from the crease between two overlapping shapes may start inside one of them, as deep as the clearance.
    """
    return (si.wi.z > 0) | mi.has_flag(bsdf.flags(), mi.BSDFFlags.BackSide)


@dr.syntax
def visible(box: Box, o: mi.Point3f, d: mi.Vector3f, active: mi.Bool) -> mi.Bool:
    """Whether nothing is in the way from ``o`` along ``d`` to the top."""
    o, seen, active, steps = mi.Point3f(o), mi.Bool(active), mi.Bool(active), mi.UInt32(0)
    while active:
        step = box.step(o, d, active)
        blocked = step.hit & solid(step.si, step.si.bsdf())
        seen &= ~blocked
        active &= ~blocked & ~step.left & (steps < STEPS)
        o = dr.select(step.hit, box.leave(step.si, d), step.next)
        steps += 1
    return seen & (steps < STEPS)


@dr.syntax
def trace(
    tile: Tile, sensor: Sensor, wi: np.ndarray, settings: Settings, seed: np.random.SeedSequence, lanes: int
) -> np.ndarray:
    """Shoot ``lanes`` paths from ``wi``; return their energy in units: (orders, cells + EXTRA, channels)."""
    box, ctx = Box(tile, settings.wavelengths), mi.BSDFContext()
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

    o, d = box.enter(rng, corner, lanes), -opaque(mi.Vector3f, *wi)
    if dr.hint(aimed, mode="scalar"):
        target = dr.arange(mi.UInt32, lanes) % cells
        to = dr.gather(mi.Vector3f, mi.Vector3f(sensor.directions(wi)[:, 0].T), target)
    weight, order, steps, active = mi.UnpolarizedSpectrum(1), mi.UInt32(0), mi.UInt32(0), mi.Bool(True)
    while active:
        step = box.step(o, d, active)
        si, bsdf = step.si, step.si.bsdf()
        facet = step.hit & solid(si, bsdf)
        lost = ~step.left & ((facet & (order == settings.limit)) | (steps == STEPS))
        scattered = facet & ~lost

        cell, inside = locate(frame.to_local(d))
        column = dr.select(d.z < 0, cells + BELOW, dr.select(inside, cell, cells + ELSEWHERE))
        count(order, column, weight, step.left)
        count(order, cells + CUT, weight, lost)
        if dr.hint(aimed, mode="scalar"):
            value = mi.unpolarized_spectrum(bsdf.eval(ctx, si, si.to_local(to), scattered))
            lit = scattered & dr.any(value > 0)
            count(order + 1, target, weight * value, visible(box, box.leave(si, to), to, lit))

        bs, share = bsdf.sample(
            ctx, si, rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32()), scattered
        )
        weight = dr.select(scattered, weight * mi.unpolarized_spectrum(share), weight)
        d = dr.select(scattered, si.to_world(bs.wo), d)
        o = dr.select(step.hit, box.leave(si, d), step.next)
        order += dr.select(scattered, mi.UInt32(1), 0)
        strength = dr.max(weight)
        survival = dr.minimum(strength / DARK, 1)
        active &= ~step.left & ~lost & (rng.next_float32() < survival)
        steps += 1
        weight /= dr.maximum(survival, 1e-20)
    return np.array(energy).reshape(settings.orders, columns, channels)


def _distance(gap, speed):
    """Time to cover ``gap`` at ``speed``, never negative; infinite at rest."""
    return dr.select(speed == 0, dr.inf, dr.maximum(gap / speed, 0))


def _every_second_bit(x):
    """The even bits of 32, squeezed into 16."""
    x = x & 0x55555555
    for shift, mask in ((1, 0x33333333), (2, 0x0F0F0F0F), (4, 0x00FF00FF), (8, 0x0000FFFF)):
        x = (x | (x >> shift)) & mask
    return x
