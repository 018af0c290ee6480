"""The same BSDF in every variant of Mitsuba."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from asperity.lab import evaluate

from .results import Result, complaint

OTHER_COLOURS = "require the use of a"
"""In what Mitsuba says of a file that holds RGB only in a spectral variant, and the other way round."""


def usable_variants() -> tuple[list[str], list[str]]:
    """Return the variants that this machine can run, and those that it cannot."""
    cuda = dr.has_backend(dr.JitBackend.CUDA)
    usable = [v for v in mi.variants() if cuda or not v.startswith("cuda")]
    return usable, [v for v in mi.variants() if v not in usable]


def probe(description: dict[str, Any]) -> tuple[np.ndarray, bool]:
    """Load in the active variant; return values (channels, n) at fixed directions, and tell if all is finite."""
    bsdf = evaluate.load(description)
    rng, n = np.random.default_rng(21), 64
    pairs = rng.normal(size=(n, 2, 3))
    pairs = (pairs / np.linalg.norm(pairs, axis=2, keepdims=True)).astype(np.float32)
    numbers = rng.random((n, 3), dtype=np.float32)
    if dr.is_jit_v(mi.Float):
        wi, wo = (evaluate.vectors(pairs[:, k]) for k in (0, 1))
        return probe_lanes(bsdf, wi, wo, mi.Float(numbers[:, 0]), mi.Point2f(numbers[:, 1:].T), n)
    lanes = [
        probe_lanes(bsdf, mi.Vector3f(wi), mi.Vector3f(wo), u[0], mi.Point2f(u[1:]), 1)
        for (wi, wo), u in zip(pairs.tolist(), numbers.tolist())
    ]
    return np.concatenate([values for values, _ in lanes], axis=1), all(finite for _, finite in lanes)


def probe_lanes(
    bsdf: mi.BSDF, wi: mi.Vector3f, wo: mi.Vector3f, sample1: mi.Float, sample2: mi.Point2f, lanes: int
) -> tuple[np.ndarray, bool]:
    """Return values (channels, lanes), and tell if they, the pdf and the samples are finite."""
    _, weight = evaluate.sample(bsdf, wi, sample1, sample2)
    value = evaluate.to_numpy(evaluate.eval(bsdf, wi, wo), lanes)
    others = (evaluate.to_numpy(x, lanes) for x in (evaluate.pdf(bsdf, wi, wo), weight))
    return value, all(np.isfinite(x).all() for x in (value, *others))


def variants(description: dict[str, Any] | mi.BSDF) -> Result:
    """Load, evaluate and sample in every variant; compare the values of the RGB variants."""
    if not isinstance(description, dict):
        return Result("variants", None, "needs the dictionary: an object belongs to one variant")
    usable, absent = usable_variants()
    before, values = evaluate.active_variant(), {}
    troubles: list[str] = []
    skipped: list[str] = []
    for variant in usable:
        try:
            mi.set_variant(variant)
            values[variant], finite = probe(description)
            if not finite:
                troubles.append(f"{variant}: not finite")
        except Exception as error:  # whatever a plugin raises is its trouble, and is reported
            (skipped if OTHER_COLOURS in str(error) else troubles).append(f"{variant}: {complaint(error)}")
        finally:
            mi.set_variant(before)
    rgb = [v for v in values if "rgb" in v]
    deviation = max((float(np.abs(values[v] - values[rgb[0]]).max() / scale(values[rgb[0]])) for v in rgb), default=0.0)
    measured = "; ".join(troubles) or f"{len(values)} variants agree to {deviation:.1g}"
    return Result(
        "variants",
        not troubles and deviation < 1e-4,
        measured
        + (f" ({len(absent)} need a GPU: skipped)" if absent else "")
        + (f" ({len(skipped)} need other colours: skipped; {skipped[0]})" if skipped else ""),
        f"loads, finite; {' = '.join(rgb)} to 1e-4 of the largest value: same formulas, other rounding",
    )


def scale(values: np.ndarray) -> float:
    """Return the largest magnitude, or 1 if all are zero."""
    return float(np.abs(values).max()) or 1.0
