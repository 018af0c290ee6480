"""The directions that checks look from, and the samples that they draw there."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from asperity.lab import evaluate

INCIDENT = ((12, 27), (45, 113), (75, 201), (85, 288))
"""Elevations from the normal and azimuths, in degrees. No azimuth is special to a lobe, a groove or a table."""

PAIRS = 1_000_000
SAMPLES = 200_000


def sides(bsdf: mi.BSDF) -> tuple[int, ...]:
    """Return (1,) if the BSDF is black from below, else (1, -1). Asks the BSDF, whose flags may be wrong."""
    n = 10_000
    wi = -evaluate.uniform_hemisphere(n, 1)
    value = evaluate.eval(bsdf, wi, evaluate.uniform_sphere(n, 2))
    _, weight = evaluate.sample(bsdf, wi, *evaluate.variates(n, 3))
    black = not any(evaluate.to_numpy(x, n).any() for x in (value, weight))
    return (1,) if black else (1, -1)


def incident(bsdf: mi.BSDF) -> list[tuple[float, float]]:
    """Return the incident directions to test: those below the horizon too if the BSDF is not black there."""
    return [(theta if side > 0 else 180 - theta, phi) for side in sides(bsdf) for theta, phi in INCIDENT]


def random_incident(bsdf: mi.BSDF, n: int, seed: int) -> mi.Vector3f:
    """Return ``n`` incident directions, uniform over the sides from which the BSDF is not black."""
    return (evaluate.uniform_hemisphere if sides(bsdf) == (1,) else evaluate.uniform_sphere)(n, seed)


@dataclass(frozen=True)
class Samples:
    """``n`` sampled directions; ``smooth`` selects those that are neither lost nor from a delta lobe."""

    wi: mi.Vector3f
    drawn: mi.BSDFSample3f
    weight: np.ndarray
    smooth: np.ndarray


def kept(bsdf: mi.BSDF, wi: mi.Vector3f, drawn: mi.BSDFSample3f, weight: mi.UnpolarizedSpectrum) -> mi.Bool:
    """Tell which samples are not lost.

    A weight of 0 does not tell: it underflows at grazing angles. Nor does a positive pdf: Mitsuba's own plugins leave
    one in samples that they reject. A sample of weight 0 is kept if ``eval`` is 0 there too, and ``pdf`` confirms its
    pdf; otherwise it was rejected, and the histogram has to show that this was right.
    """
    value, density = evaluate.eval_pdf(bsdf, wi, drawn.wo)
    black = dr.all(value == 0) & (density > 0) & (dr.abs(drawn.pdf - density) < 0.01 * density)
    return dr.any(weight != 0) | black


def draw_samples(bsdf: mi.BSDF, wi: mi.Vector3f, n: int, seed: int) -> Samples:
    """Sample ``n`` directions for ``wi``."""
    drawn, weight = evaluate.sample(bsdf, wi, *evaluate.variates(n, seed))
    smooth = kept(bsdf, wi, drawn, weight) & ~mi.has_flag(drawn.sampled_type, mi.BSDFFlags.Delta)
    dr.eval(drawn, weight, smooth)
    return Samples(wi, drawn, evaluate.to_numpy(weight, n), evaluate.to_numpy(smooth, n)[0] > 0)
