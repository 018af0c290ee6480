"""The base between the grains: how much of it is seen, and how much of that is lit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr

from ...lobes import Opening, above
from .grains import Grains, exposure
from .shadows import Shadows, shadow


def visibility(r: Any, shaded: Any) -> Any:
    """V_p = (1 - tau_0) Gdist(i, o, 0), for the area ``shaded`` along i or o at height 0 (Lucas 2024, Eq. 23)."""
    return exposure(r, 0, shaded)


@dataclass
class Pores(Opening):
    """How the base is seen between grains.

    Beyond the paper, below the surface: nothing casts shadows there, but light meets the base through pores only, from
    either side. What arrives from below under a grain is absorbed, total internal reflection included.
    """

    grains: Grains
    shaded: Callable[[Shadows, Any], Any] = Shadows.union

    def share(self, wi: Any) -> Any:
        """1 - tau_i, which is exact; Lucas 2024, Eq. 26 gives the pores too much."""
        return dr.select(wi.z > 0, 1 - self.grains.visible(self.grains.lift(above(wi))), 1)

    def reach(self, wi: Any, wo: Any) -> Any:
        """V_p(i, o)."""
        i, o = (self.grains.to_sphere(self.grains.lift(above(w))) for w in (wi, wo))
        one = dr.select(wi.z > 0, shadow(i, 0), 0) + dr.select(wo.z > 0, shadow(o, 0), 0)
        both = (wi.z > 0) & (wo.z > 0)
        return dr.select(both, self.both(i, o), visibility(self.grains.r, one))

    def both(self, i: Any, o: Any) -> Any:
        """V_p of two directions from above, in sphere space."""
        return visibility(self.grains.r, self.shaded(Shadows(i, o), 0))
