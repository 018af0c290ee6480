"""Directional albedo, without noise."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi

from .numerics import clamp
from .quadrature import accumulate

FEW = 16
"""Samples of `upright_albedo`."""


def directional_albedo(
    sample: Callable, si: mi.SurfaceInteraction3f, active: Any, samples: int, copies: bool = False
) -> Any:
    """Reflected and transmitted share of the light from ``si.wi``: the mean weight of the same samples every time.

    ``sample(ctx, si, sample1, sample2, active)`` is a BSDF's, with an unpolarised weight. A loop is recorded, unless
    derivatives are needed and ``copies`` asked for, which few samples can afford and forward derivatives may need.
    """

    def weight(index: Any, captured: Any) -> tuple[Any]:
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


def upright_albedo(bsdf: Any, si: Any, active: Any) -> Any:
    """Albedo of a BSDF at normal incidence, in [0, 1]: where Mitsuba's is right, that."""
    upright = mi.SurfaceInteraction3f(si)
    upright.wi = mi.Vector3f(0, 0, 1)
    beyond_diffuse = int(mi.BSDFFlags.Glossy | mi.BSDFFlags.Delta | mi.BSDFFlags.Transmission)
    if not bsdf.flags() & beyond_diffuse:
        return clamp(mi.unpolarized_spectrum(bsdf.eval_diffuse_reflectance(upright, active)), 0, 1)

    def reflected(ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any) -> tuple[Any, Any]:
        bs, weight = bsdf.sample(ctx, si, sample1, sample2, active)
        return bs, mi.unpolarized_spectrum(weight) & (bs.wo.z > 0)

    return clamp(directional_albedo(reflected, upright, active, FEW, copies=True), 0, 1)
