"""Textures that models need and Mitsuba lacks."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from ..parameters import Declared, Texture


class Settled(Declared):
    """How much has settled on a surface: ``top`` where its normal points up (+z), ``bottom`` where it points down.

    Between them, a smooth step of the normal's vertical component around ``threshold`` (Lucas 2024, Fig. 1b).
    """

    between = ("top", "bottom")

    top = Texture("value on upward surfaces", 0.6)
    bottom = Texture("value on downward surfaces", 0.0, unit="")
    threshold = Texture("vertical component of the normal half way between them", 0.3, low=-1, high=1)
    softness = Texture("half the width of the step, in the same component", 0.6, low=1e-6, high=4)

    def eval(self, si: mi.SurfaceInteraction3f, active: Any) -> Any:
        """Value at a surface point, from its world-space shading normal."""
        top, bottom, threshold, softness = (
            self.number(name, si, active) for name in ("top", "bottom", "threshold", "softness")
        )
        # The side does not matter to a twosided material seen from below: n is the surface's own outward normal.
        t = dr.clip((si.sh_frame.n.z - threshold) / softness / 2 + 0.5, 0, 1)
        return bottom + (top - bottom) * t * t * (3 - 2 * t)

    def mean(self) -> Any:
        """Mean over all directions of the normal, nearly."""
        return (self.top.mean() + self.bottom.mean()) / 2
