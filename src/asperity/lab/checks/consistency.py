"""Two ways to the same number: they have to agree pair by pair of directions."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from asperity.lab import evaluate

from .results import Result, Violations, violations
from .samples import PAIRS, SAMPLES, Samples, draw_samples, random_incident, sides

NOT_RECIPROCAL = {
    "Hair": "a fibre's light leaves where it did not enter, and the BSDF is told only one of the two places",
    "NormalMap": "shading normals break reciprocity: light is received by one cosine, and counted by another",
    "BumpMap": "shading normals break reciprocity: light is received by one cosine, and counted by another",
}
"""By the class's name in Mitsuba, what is not reciprocal by what it describes, and why."""


def compare_lanes(
    name: str,
    wi: mi.Vector3f,
    wo: mi.Vector3f,
    pair: tuple[np.ndarray, np.ndarray],
    tolerance: tuple[float, float],
    outliers: float,
    why: str,
) -> Result:
    """Compare values (channels, n) lane by lane, to a relative and an absolute tolerance.

    A fraction ``outliers`` of the lanes may deviate more.
    """
    a, b = pair
    relative, absolute = tolerance
    with np.errstate(invalid="ignore"):  # inf - inf
        excess = (np.abs(a - b) / (relative * np.maximum(np.abs(a), np.abs(b)) + absolute)).max(axis=0)
    excess = np.where(np.isfinite(excess), excess, np.inf)
    beyond = float((excess > 1).mean())
    i, o = (np.array(w)[:, excess > 1].T for w in (wi, wo))
    return Result(
        name,
        beyond <= outliers,
        f"{beyond:.2%} of {excess.size} beyond tolerance; 99.9% agree to {relative * np.quantile(excess, 0.999):.1g}",
        f"{relative:g} relative + {absolute:g}" + (f" for all but {outliers:.2%}" if outliers else "") + f": {why}",
        Violations(i, o, excess[excess > 1], name),
    )


def smooth_samples(bsdf: mi.BSDF) -> tuple[Samples, np.ndarray, np.ndarray] | None:
    """Sample random incident directions; also return wi and wo (3, n) of the smooth lobes. None if there are none."""
    samples = draw_samples(bsdf, random_incident(bsdf, SAMPLES, 5), SAMPLES, seed=6)
    if not samples.smooth.any():
        return None
    wi, wo = (evaluate.to_numpy(w, SAMPLES)[:, samples.smooth] for w in (samples.wi, samples.drawn.wo))
    return samples, wi, wo


def weights(bsdf: mi.BSDF) -> Result:
    """Compare the weight of a sample with eval / pdf of its direction."""
    if (found := smooth_samples(bsdf)) is None:
        return Result("weight", None, "samples only delta lobes")
    samples, wi, wo = found
    value = evaluate.to_numpy(evaluate.eval(bsdf, samples.wi, samples.drawn.wo), SAMPLES)[:, samples.smooth]
    density = evaluate.to_numpy(evaluate.pdf(bsdf, samples.wi, samples.drawn.wo), SAMPLES)[:, samples.smooth]
    ratio = np.divide(value, density, out=np.zeros_like(value), where=density > 0)
    why = "weight = eval / pdf; the half vector found again from wo has rounding errors, which narrow lobes amplify"
    return compare_lanes("weight", wi, wo, (samples.weight[:, samples.smooth], ratio), (1e-3, 1e-5), 1e-3, why)


def sampled_pdf(bsdf: mi.BSDF) -> Result:
    """Compare the pdf that ``sample`` returns with ``pdf`` of the direction."""
    if (found := smooth_samples(bsdf)) is None:
        return Result("sampled-pdf", None, "samples only delta lobes")
    samples, wi, wo = found
    density = evaluate.to_numpy(evaluate.pdf(bsdf, samples.wi, samples.drawn.wo), SAMPLES)[:, samples.smooth]
    returned = evaluate.to_numpy(samples.drawn.pdf, SAMPLES)[:, samples.smooth]
    why = "both are the density of the same direction, up to rounding errors, which narrow lobes amplify"
    return compare_lanes("sampled-pdf", wi, wo, (returned, density), (1e-3, 1e-5), 1e-3, why)


def eval_pdf(bsdf: mi.BSDF) -> Result:
    """Compare ``eval_pdf`` with ``eval`` and ``pdf``."""
    wi, wo = random_incident(bsdf, SAMPLES, 7), evaluate.uniform_sphere(SAMPLES, 8)
    value, density = evaluate.eval_pdf(bsdf, wi, wo)
    both = np.concatenate([evaluate.to_numpy(x, SAMPLES) for x in (value, density)])
    apart = (evaluate.eval(bsdf, wi, wo), evaluate.pdf(bsdf, wi, wo))
    single = np.concatenate([evaluate.to_numpy(x, SAMPLES) for x in apart])
    why = "the same formulas, compiled apart: fused multiply-adds may round differently"
    return compare_lanes("eval-pdf", wi, wo, (both, single), (1e-4, 1e-6), 1e-4, why)


def determinism(bsdf: mi.BSDF) -> Result:
    """Call everything twice: bit for bit the same."""
    wi, wo = random_incident(bsdf, SAMPLES, 9), evaluate.uniform_sphere(SAMPLES, 10)
    dr.eval(wi, wo)

    def call() -> np.ndarray:
        drawn, weight = evaluate.sample(bsdf, wi, *evaluate.variates(SAMPLES, 11))
        values = evaluate.eval(bsdf, wi, wo), evaluate.pdf(bsdf, wi, wo), drawn.wo, drawn.pdf, weight
        return np.concatenate([evaluate.to_numpy(x, SAMPLES) for x in values])

    first, second = call(), call()
    differs = ~np.isclose(first, second, rtol=0, atol=0, equal_nan=True).all(axis=0)
    return Result(
        "determinism",
        not differs.any(),
        f"{differs.mean():.2%} of {SAMPLES} calls differ",
        "0%, bit for bit: MIS, fitting and plots assume that a BSDF is a function",
        violations(wi, wo, differs, "second call differs"),
    )


def reciprocity(bsdf: mi.BSDF) -> Result:
    """Compare f(wi, wo) with f(wo, wi) on random pairs, and on pairs that formulas treat apart.

    ``eval`` holds one cosine: multiplying by the other spares a division. Refraction squeezes radiance by η², but
    leaves importance alone: f(wi, wo) of radiance equals f(wo, wi) of importance. That is reciprocity where nothing
    refracts, and needs no knowledge of η where something does.
    """
    if (reason := NOT_RECIPROCAL.get(bsdf.class_name())) is not None:
        return Result("reciprocity", None, reason)
    wi, wo = (random_incident(bsdf, PAIRS, seed) for seed in (12, 13))
    i, o = map(evaluate.vectors, evaluate.special_pairs(both_sides=sides(bsdf) != (1,)))
    at_random, at_special = both_ways(bsdf, wi, wo), both_ways(bsdf, i, o)
    if not any(values.any() for values in (*at_random, *at_special)):
        return Result("reciprocity", None, "has only delta lobes")
    refracts = mi.has_flag(bsdf.flags(), mi.BSDFFlags.NonSymmetric)
    why = "Helmholtz, float32" + ("; refracted pairs: radiance against importance, for the η²" if refracts else "")
    found = compare_lanes("reciprocity", wi, wo, at_random, (1e-3, 1e-5), 1e-5, why)
    apart = compare_lanes("reciprocity", i, o, at_special, (1e-3, 1e-5), 0, why + "; normal, coplanar, retro, mirror")
    return apart if found.passed and not apart.passed else found


def both_ways(bsdf: mi.BSDF, wi: mi.Vector3f, wo: mi.Vector3f) -> tuple[np.ndarray, np.ndarray]:
    """Return f(wi, wo) of radiance and f(wo, wi) of importance (channels, n), both times both cosines."""
    lanes, adjoint = dr.width(wo.x), mi.BSDFContext()
    adjoint.mode = mi.TransportMode.Importance
    forth = evaluate.eval(bsdf, wi, wo) * dr.abs(wi.z)
    back = mi.unpolarized_spectrum(bsdf.eval(adjoint, evaluate.interaction(wo), wi)) * dr.abs(wo.z)
    return evaluate.to_numpy(forth, lanes), evaluate.to_numpy(back, lanes)
