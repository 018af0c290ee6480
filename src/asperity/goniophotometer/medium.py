"""A half space of particles far apart: light flies straight for a while, is scattered by one, and flies on.

That is classical transport: a random walk, without a scene. The unit of length is the mean free path.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from .microgeometry import Step
from .tile import opaque


@dataclass(frozen=True)
class SparseMedium:
    """A piece of it; ``particle`` scatters like a BSDF, in a frame whose z is the direction of flight."""

    particle: Any

    def rays(self, wavelengths: tuple[float, ...]) -> Walk:
        """The half space for light of these wavelengths."""
        return Walk(self.particle, opaque(mi.UnpolarizedSpectrum, *wavelengths) if mi.is_spectral else mi.Color0f())

    def facets(self) -> dict[str, Any]:
        """All particles are alike."""
        return {"particles": self.particle}


class Walk:
    """Rays in a half space, of which only the height matters."""

    def __init__(self, particle: Any, wavelengths: Any):
        self.particle, self.wavelengths = particle, wavelengths

    def enter(self, rng: mi.PCG32, corner: Any, lanes: int) -> mi.Point3f:
        """At the surface."""
        return mi.Point3f(0, 0, dr.zeros(mi.Float, lanes))

    def step(self, rng: mi.PCG32, o: mi.Point3f, d: mi.Vector3f, active: mi.Bool) -> Step:
        """Fly for an exponentially distributed distance."""
        distance = -dr.log(1 - rng.next_float32())
        height = o.z + distance * d.z
        si = dr.zeros(mi.SurfaceInteraction3f, dr.width(height))
        si.t, si.p, si.wavelengths = distance, mi.Point3f(0, 0, height), self.wavelengths
        si.n = mi.Normal3f(d)
        si.sh_frame = mi.Frame3f(d)
        si.wi = mi.Vector3f(0, 0, -1)
        left = height > 0
        return Step(si, self.particle, active & ~left, active & left, o)

    def leave(self, si: Any, d: mi.Vector3f) -> mi.Point3f:
        """From where it was scattered."""
        return si.p
