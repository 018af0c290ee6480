"""Directional albedo, without noise."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi


def directional_albedo(sample: Callable, si: mi.SurfaceInteraction3f, active: Any, samples: int) -> Any:
    """Reflected and transmitted share of the light from ``si.wi``: the mean weight of the same samples every time.

    ``sample(ctx, si, sample1, sample2, active)`` is a BSDF's, with an unpolarised weight.
    """

    def add(index, total):
        # Strata for the choice of the lobe, the R2 sequence (Roberts 2018) for the direction.
        steps = (mi.Float(index) * a + 0.5 for a in (0.6180339887, 0.7548776662, 0.5698402910))
        jitter, u, v = (step - dr.floor(step) for step in steps)
        _, weight = sample(mi.BSDFContext(), si, (mi.Float(index) + jitter) / samples, mi.Point2f(u, v), active)
        return index + 1, total + weight

    start = mi.UInt32(0), mi.UnpolarizedSpectrum(0)
    _, total = dr.while_loop(start, lambda index, _: index < samples, add, max_iterations=samples)
    return total / samples
