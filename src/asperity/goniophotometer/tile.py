"""A microgeometry that rays of Mitsuba's hit: one period of a surface, as a scene."""

from __future__ import annotations

from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from .microgeometry import Step

CLEARANCE = 3e-7
"""Rays leave a facet by this share of the tile's size: ten roundings of float32 at its edge. Albedos err by 2e-5."""
OPTIX = 4
"""On GPUs, rays reach that many clearances past walls and bottom: OptiX's distances to triangles are off by roundings
of the tile's size, unlike Embree's. Without it, half of the light passed through the base of a flat tile."""
VISIBLE = (440.0, 520.0, 580.0, 650.0)
"""nm, in spectral variants, unless others are asked for."""


class Tile(NamedTuple):
    """One period of a surface. Its normal is z; the middle of the tile is the origin of x and y.

    Shapes of ``scene`` that stick out of the tile must be there twice: once more where the next tile's stick in.
    """

    scene: mi.Scene
    width: float  # period in x
    depth: float  # period in y
    bottom: float  # height below which there is nothing
    top: float  # height above which there is nothing
    random: bool = False  # whether it stands for an endless surface, of which it is a piece drawn by chance
    window: float = np.inf  # side of the square through which a batch of rays enters: coherent rays are fast rays

    def rays(self, wavelengths: tuple[float, ...] = VISIBLE) -> Box:
        """The tile for rays of these wavelengths."""
        return Box(self, wavelengths)

    def facets(self) -> dict[str, mi.BSDF]:
        """The BSDFs of its shapes, by name."""
        return {shape.id(): shape.bsdf() for shape in self.scene.shapes()}


class Box:
    """A tile as rays see it: what they hit, and the walls about it."""

    def __init__(self, tile: Tile, wavelengths: tuple[float, ...]):
        self.scene = tile.scene
        self.half = opaque(mi.Point2f, tile.width / 2, tile.depth / 2)
        self.heights = opaque(mi.Point2f, tile.bottom, tile.top)
        self.window = opaque(mi.Point2f, min(tile.window, tile.width), min(tile.window, tile.depth))
        extent = max(tile.width, tile.depth, tile.top - tile.bottom)
        self.clearance = dr.opaque(mi.Float, CLEARANCE * extent)
        self.beyond = OPTIX * self.clearance if dr.backend_v(mi.Float) == dr.JitBackend.CUDA else mi.Float(0)
        self.wavelengths = opaque(mi.UnpolarizedSpectrum, *wavelengths) if mi.is_spectral else mi.Color0f()

    def enter(self, rng: mi.PCG32, corner: Any, lanes: int) -> mi.Point3f:
        """Points at the top, uniform over the window, in Z-order: what is near in the array is near on the surface."""
        stride = min(2**32 // lanes, 2**32 - 1)
        z_order = dr.arange(mi.UInt32, lanes) * stride + rng.next_uint32() % stride
        where = mi.Point2f(*(_every_second_bit(z_order >> k) for k in (0, 1)))
        where = (where + mi.Point2f(rng.next_float32(), rng.next_float32())) / 2**16
        turns = corner + where * self.window / (2 * self.half)
        x, y = ((turns - dr.floor(turns)) * 2 - 1) * self.half
        return mi.Point3f(x, y, self.heights.y)

    def step(self, rng: mi.PCG32, o: mi.Point3f, d: mi.Vector3f, active: mi.Bool) -> Step:
        """Follow rays to the nearest facet or wall. The backs of one-sided facets are air.

        Rays from the crease between two overlapping shapes may start inside one of them, as deep as the clearance.
        """
        to_x, to_y = (_distance(dr.copysign(half, w) - p, w) for half, p, w in zip(self.half, o, d))
        to_end = _distance(dr.select(d.z > 0, self.heights.y, self.heights.x) - o.z, d.z)
        to_side = dr.minimum(to_x, to_y)
        nearest = dr.minimum(to_side, to_end)
        ray = mi.Ray3f(o, d, nearest + self.beyond, 0.0, self.wavelengths)
        si = self.scene.ray_intersect(ray, mi.RayFlags.All, False, active)
        met = active & si.is_valid()
        bsdf = si.bsdf()
        solid = (si.wi.z > 0) | mi.has_flag(bsdf.flags(), mi.BSDFFlags.BackSide)
        there = o + d * nearest
        x = dr.select(to_x <= to_y, -dr.copysign(self.half.x, d.x), there.x)
        y = dr.select(to_y <= to_x, -dr.copysign(self.half.y, d.y), there.y)
        onwards = dr.select(met, self.leave(si, d), mi.Point3f(x, y, there.z))
        return Step(si, bsdf, met & solid, active & ~met & (to_end <= to_side), onwards)

    def leave(self, si: mi.SurfaceInteraction3f, d: mi.Vector3f) -> mi.Point3f:
        """Where a ray along ``d`` starts from a facet."""
        return si.p + si.n * dr.copysign(self.clearance, dr.dot(si.n, d))


def opaque(kind: type, *numbers: float) -> Any:
    """A vector of numbers that are no constants to Dr.Jit: one kernel serves them all."""
    return kind(*(dr.opaque(mi.Float, float(x)) for x in numbers))


def _distance(gap, speed):
    """Time to cover ``gap`` at ``speed``, never negative; infinite at rest."""
    return dr.select(speed == 0, dr.inf, dr.maximum(gap / speed, 0))


def _every_second_bit(x):
    """The even bits of 32, squeezed into 16."""
    x = x & 0x55555555
    for shift, mask in ((1, 0x33333333), (2, 0x0F0F0F0F), (4, 0x00FF00FF), (8, 0x0000FFFF)):
        x = (x | (x >> shift)) & mask
    return x
