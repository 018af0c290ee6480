"""Finite and not negative, even at directions and random numbers where formulas divide by zero."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from asperity.lab import evaluate

from .results import Result, Violations, violations
from .samples import kept


def improper(lanes: int, *values: Any) -> np.ndarray:
    """Tell in which lanes a value is negative or not finite."""
    rows = np.concatenate([evaluate.to_numpy(x, lanes) for x in values])
    return ~(np.isfinite(rows) & (rows >= 0)).all(axis=0)


def improprieties(bsdf: mi.BSDF) -> dict[str, Violations]:
    """Evaluate and sample at hard directions and with extreme random numbers; return what is bad, by its kind."""
    wi, wo = evaluate.hard_pairs()
    lanes = dr.width(wo.x)
    value, density = evaluate.eval(bsdf, wi, wo), evaluate.pdf(bsdf, wi, wo)
    found = {"eval": violations(wi, wo, improper(lanes, value), "eval")}
    found["pdf"] = violations(wi, wo, improper(lanes, density), "pdf")

    hard, numbers = evaluate.hard_directions(), np.array([0, 1e-7, 0.3, 0.7, 1 - 2**-24], dtype=np.float32)
    k, u, v, w = (a.ravel() for a in np.meshgrid(np.arange(len(hard)), numbers, numbers, numbers))
    wi = evaluate.vectors(hard[k])
    drawn, weight = evaluate.sample(bsdf, wi, mi.Float(u), mi.Point2f(v, w))
    found["weight"] = violations(wi, drawn.wo, improper(k.size, weight), "weight")
    # Zero-initialised samples have η = 0, which ends every path at the first Russian roulette.
    sound = (drawn.pdf > 0) & (drawn.pdf < dr.inf) & (dr.abs(dr.norm(drawn.wo) - 1) < 1e-3) & (drawn.eta > 0)
    unsound = evaluate.to_numpy(kept(bsdf, wi, drawn, weight) & ~sound, k.size)[0] > 0
    found["sample"] = violations(wi, drawn.wo, unsound, "sampled pdf or η not positive, or wo not of length 1")
    return found


def finiteness(bsdf: mi.BSDF) -> Result:
    """Look for values that are not finite, or negative."""
    found = improprieties(bsdf)
    return Result(
        "finiteness",
        not any(v.excess.size for v in found.values()),
        "; ".join(f"{name}: {v.excess.size} bad" for name, v in found.items()),
        "0: finite and ≥ 0 at grazing and horizontal directions, wi = wo, mirror, normal, and nearby",
        max(found.values(), key=lambda v: v.excess.size),
    )
