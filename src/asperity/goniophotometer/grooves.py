"""V-grooves with their rims in one plane: what enters a groove stays in it until it leaves through its opening.

So each ray has a groove of its own, and two planes are all that it can hit: an endless surface, without a scene.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi

from .microgeometry import Step
from .tile import opaque


class Shape(NamedTuple):
    """A groove along the horizontal ``axis`` x ``across``; both facets' tilts from the horizontal in (0, π/2)."""

    across: mi.Vector2f  # unit vector, towards which the first facet tilts
    first: mi.Float
    second: mi.Float


@dataclass(frozen=True)
class Grooves:
    """A piece of surface; ``draw(rng)`` makes a groove for each lane, all of them with openings equally wide."""

    draw: Callable[[mi.PCG32], Shape]
    bsdf: Any  # a BSDF, or what can be sampled and evaluated like one

    def rays(self, wavelengths: tuple[float, ...]) -> GrooveRays:
        """The grooves for rays of these wavelengths."""
        return GrooveRays(self, opaque(mi.UnpolarizedSpectrum, *wavelengths) if mi.is_spectral else mi.Color0f())

    def facets(self) -> dict[str, Any]:
        """Both are alike."""
        return {"facets": self.bsdf}


class GrooveRays:
    """Rays in grooves. A point is (x across the opening, in [0, 1]; 0; height): where along it is does not matter."""

    def __init__(self, grooves: Grooves, wavelengths: Any):
        self.grooves, self.wavelengths = grooves, wavelengths

    def enter(self, rng: mi.PCG32, corner: Any, lanes: int) -> mi.Point3f:
        """Draw the grooves, and points over their openings."""
        across, first, second = self.grooves.draw(rng)
        self.across = mi.Vector3f(across.x, across.y, 0)
        up = mi.Vector3f(0, 0, 1)
        self.normals = [dr.sin(t) * s * self.across + dr.cos(t) * up for s, t in ((1, first), (-1, second))]
        return mi.Point3f(rng.next_float32(), 0, 0)

    def step(self, rng: mi.PCG32, o: mi.Point3f, d: mi.Vector3f, active: mi.Bool) -> Step:
        """Follow rays to the nearer of the two planes, or out."""
        to_first, to_second = (self._distance(o - mi.Vector3f(x, 0, 0), d, n) for x, n in zip((0, 1), self.normals))
        nearest = dr.minimum(to_first, to_second)
        left = (d.z > 0) & (nearest * d.z >= -o.z)
        si = dr.zeros(mi.SurfaceInteraction3f, dr.width(o))
        si.t, si.wavelengths = nearest, self.wavelengths
        si.n = mi.Normal3f(dr.select(to_first < to_second, *self.normals))
        si.sh_frame = mi.Frame3f(si.n)
        si.wi = si.to_local(-d)
        si.p = mi.Point3f(o.x + nearest * dr.dot(d, self.across), 0, o.z + nearest * d.z)
        return Step(si, self.grooves.bsdf, active & ~left, active & left, o)

    def _distance(self, o: mi.Vector3f, d: mi.Vector3f, normal: mi.Vector3f) -> mi.Float:
        """To a plane through the origin, met from above."""
        cos = dr.dot(d, normal)
        above = o.x * dr.dot(normal, self.across) + o.z * normal.z
        return dr.select(cos < 0, dr.maximum(-above / cos, 0), dr.inf)

    def leave(self, si: Any, d: mi.Vector3f) -> mi.Point3f:
        """A facet is never hit again by what leaves it: planes are met from above only."""
        return si.p
