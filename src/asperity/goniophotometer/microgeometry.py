"""What the goniophotometer measures: anything that says what becomes of a ray.

A `Microgeometry` is a kind of surface. Its `piece` is a `Piece` of it, which endures a variant of Mitsuba; the piece's
`rays` are `Rays`, which endure a kernel: they let light in, and say where each ray goes next.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import mitsuba as mi
import numpy as np


class Step(NamedTuple):
    """What happens to a ray next: it hits a facet, leaves through top or bottom, or else goes on from ``onwards``."""

    si: Any
    bsdf: Any
    hit: Any
    left: Any
    onwards: Any


class Rays(Protocol):
    """A piece of surface for a batch of rays; arrays, a lane a ray."""

    def enter(self, rng: mi.PCG32, corner: Any, lanes: int) -> mi.Point3f:
        """Points above everything, uniform over the plane; ``corner`` is a random point of the unit square."""
        ...

    def step(self, rng: mi.PCG32, o: mi.Point3f, d: mi.Vector3f, active: mi.Bool) -> Step:
        """What happens next to rays from ``o`` along ``d``; in a random medium, chance decides."""
        ...

    def leave(self, si: Any, d: mi.Vector3f) -> mi.Point3f:
        """Where a ray along ``d`` starts after it was scattered at ``si``."""
        ...


class Piece(Protocol):
    """A piece of a surface: a `Tile`, which is one period of a scene, or formulas, which need not repeat."""

    def rays(self, wavelengths: tuple[float, ...]) -> Rays:
        """The piece for rays of these wavelengths (nm, in spectral variants)."""
        ...

    def facets(self) -> dict[str, mi.BSDF]:
        """What its facets are made of, by name."""
        ...


class Microgeometry(Protocol):
    """A kind of surface, from which pieces are drawn."""

    @property
    def description(self) -> dict[str, Any]:
        """What identifies it in a file of measurements; numbers, words, lists and dictionaries only."""
        ...

    def piece(self, rng: np.random.Generator) -> Piece:
        """A piece: one of many, if the surface is random, else always the same."""
        ...
