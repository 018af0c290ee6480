"""Textures that models need and Mitsuba lacks."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from ..parameters import Declared, Direction, Texture


class Settled(Declared):
    """How much has settled on a surface: ``top`` where its normal points up, ``bottom`` where it points down.

    Between them, a smooth step of the normal's component along ``up`` around ``threshold`` (Lucas 2024, Fig. 1b). It is
    a property of the point, not of who looks at it: else what light passes through were not reciprocal. So where faces
    wind the other way, their normals point inward, and ``up`` has to be turned round. Where both sides of a sheet are
    seen, give ``twosided`` two BSDFs, the second with the opposite ``up``: then its winding does not matter.
    """

    between = ("top", "bottom")

    top = Texture("value on upward surfaces", 0.6)
    bottom = Texture("value on downward surfaces", 0.0, unit="")
    up = Direction("where up is", (0, 0, 1))
    threshold = Texture("component of the normal along up, half way between them", 0.3, low=-1, high=1)
    softness = Texture("half the width of the step, in the same component", 0.6, low=1e-6, high=4)

    def eval(self, si: mi.SurfaceInteraction3f, active: Any) -> Any:
        """Value at a surface point, from its world-space shading normal."""
        top, bottom, threshold, softness = (
            self.at(name, si, active) for name in ("top", "bottom", "threshold", "softness")
        )
        facing = dr.dot(si.sh_frame.n, mi.Vector3f(*self.up))
        t = dr.clip((facing - threshold) / softness / 2 + 0.5, 0, 1)
        return bottom + (top - bottom) * t * t * (3 - 2 * t)

    def mean(self) -> Any:
        """Mean over all directions of the normal, nearly."""
        return (self.top.mean() + self.bottom.mean()) / 2
