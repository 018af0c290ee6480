"""Directional albedo, without noise."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi

from .quadrature import accumulate


def directional_albedo(
    sample: Callable, si: mi.SurfaceInteraction3f, active: Any, samples: int, copies: bool = False
) -> Any:
    """Reflected and transmitted share of the light from ``si.wi``: the mean weight of the same samples every time.

    ``sample(ctx, si, sample1, sample2, active)`` is a BSDF's, with an unpolarised weight. A loop is recorded, unless
    derivatives are needed and ``copies`` asked for, which few samples can afford and forward derivatives may need.
    """

    def weight(index, captured):
        # Strata for the choice of the lobe, the R2 sequence (Roberts 2018) for the direction.
        steps = (mi.Float(index) * a + 0.5 for a in (0.6180339887, 0.7548776662, 0.5698402910))
        jitter, u, v = (step - dr.floor(step) for step in steps)
        here = captured or (si, active)
        return (sample(mi.BSDFContext(), here[0], (mi.Float(index) + jitter) / samples, mi.Point2f(u, v), here[1])[1],)

    if copies and dr.grad_enabled(weight(0, ())):
        return sum(weight(index, ())[0] for index in range(samples)) / samples
    # Of textures, which are not in the state, forward derivatives in a direct call are too large by the number of lanes
    # if ``si`` is (Dr.Jit 1.5); in a virtual call they are right, and need it there.
    symbolic = dr.is_jit_v(si.wi) and si.wi.z.state == dr.VarState.Symbolic
    captured = (si, active) if symbolic else ()
    (total,) = accumulate(weight, mi.UInt32(samples), (mi.UnpolarizedSpectrum(0),), captured)
    return total / samples
