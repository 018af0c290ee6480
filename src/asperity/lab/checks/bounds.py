"""Parameters at the ends of their ranges: values stay finite there, and derivatives neither NaN nor dead."""

from __future__ import annotations

import math
import warnings

import drjit as dr
import mitsuba as mi
import numpy as np

from .derivatives import (
    GRADIENT_ERROR,
    ROUNDING,
    Calls,
    FiniteDifference,
    Parameters,
    Values,
    along,
    difference_error,
    pointer,
    weighted_pairs,
)
from .finiteness import improprieties
from .results import Curves, Result

REFLECTANCES = ("reflectance", "transmittance", "albedo", "color", "opacity")
"""In names of the textures of BSDFs that tell no ranges: those end at 0 and 1."""

LANES = 5_000

STEP = 1e-3
"""Into the range, relative to its length or to its end: from there derivatives are extrapolated to the end."""


def ends(parameters: Parameters, key: str) -> tuple[float, float]:
    """Return the least and the greatest value that a parameter may have; infinite where that is not known.

    An object says so by a method ``ranges``, which returns (least, greatest) by the name of a parameter or texture.
    What the innermost leaves open, the object around it may know: a colour is at most 1, whatever the texture says.
    """
    if mi.is_spectral and parameters.initial[key].size == 3:  # coefficients of a colour's spectrum: without a range
        return -math.inf, math.inf
    path = list(parameters.path(key))
    tell = [holder.ranges().get(name, (-math.inf, math.inf)) for holder, name in path if hasattr(holder, "ranges")]
    if not tell:
        named = [name for holder, name in path if isinstance(holder, mi.BSDF)]
        reflects = isinstance(path[0][0], mi.Texture) and any(word in named[0] for word in REFLECTANCES)
        return (0.0, 1.0) if reflects else (-math.inf, math.inf)
    low, high = ([end for end in both if math.isfinite(end)] for both in zip(*tell))
    return low[0] if low else -math.inf, high[0] if high else math.inf


def moved(values: Values, direction: Values, step: float) -> Values:
    """Return values some way along a direction."""
    return {key: value + step * direction[key] for key, value in values.items()}


def improper_kinds(bsdf: mi.BSDF) -> set[str]:
    """Return which of eval, pdf, weight and sample are negative or not finite somewhere."""
    return {kind for kind, found in improprieties(bsdf).items() if found.excess.size}


def bounds(bsdf: mi.BSDF) -> Result:
    """Set each parameter to each end of its range; look for NaN, and for derivatives that jump there.

    Whether those inside are right is for `gradients` to say.
    """
    parameters = Parameters(bsdf)
    both = {key: ends(parameters, key) for key in parameters.initial}
    cases = [(key, end, both[key]) for key in both for end in both[key] if math.isfinite(end)]
    if not cases:
        return Result("bounds", None, "no parameter tells its range, by a method `ranges` (see asperity.lab.checks)")
    wi, wo, weight = weighted_pairs(bsdf, LANES)
    virtual = Calls(pointer(bsdf), wi, wo)
    errors, bad = {}, []
    with parameters.restored(), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of what is unusual, as ends of ranges are
        parameters.place(parameters.initial)
        known = improper_kinds(bsdf)  # what is bad everywhere is for `finiteness` to say
        for key, end, (low, high) in cases:
            name = f"{key} = {end:g}"
            inward = min(high - low, max(1.0, abs(end))) * (1 if end == low else -1)
            values = parameters.initial | {key: np.full_like(parameters.initial[key], end)}
            direction = along({k: np.full_like(v, inward) for k, v in values.items()}, key)
            parameters.place(values)
            bad += [f"{name}: {what}" for what in sorted(improper_kinds(bsdf) - known)]
            if dr.is_diff_v(mi.Float):
                there, near, far = (
                    parameters.forward(virtual, moved(values, direction, step), direction)
                    for step in (0, STEP, 2 * STEP)
                )
                inside = FiniteDifference(2 * near - far, np.abs(near - far), ROUNDING * np.abs(near))
                errors[name] = difference_error(there, [inside], weight, if_rough=0.0)
                bad += [f"{name}: derivative"] * (not np.isfinite(there).all())
    worst = max(errors, key=lambda name: np.nan_to_num(errors[name], nan=np.inf), default="")
    measured = f"not finite, or negative: {', '.join(bad)}" if bad else f"finite at {len(cases)} ends of ranges"
    return Result(
        "bounds",
        not bad and bool(errors.get(worst, 0) < GRADIENT_ERROR),
        measured + (f"; {errors[worst]:.2g} mean relative error of the derivative at {worst}" if worst else ""),
        f"finite; derivatives at the end within {GRADIENT_ERROR} of their limit: by one of 0, no optimiser leaves it",
        Curves(list(errors), {"at the bound": np.array(list(errors.values()))}, "mean relative error", GRADIENT_ERROR),
    )
