"""Sampling against its density: χ² over the whole sphere, and the integral of the pdf."""

from __future__ import annotations

from functools import cache

import drjit as dr
import mitsuba as mi
import numpy as np
from scipy import stats

from asperity.lab import evaluate

from .results import SIGNIFICANCE, Curves, Histogram, Result, named, sidak
from .samples import PAIRS, draw_samples, incident

ROWS, COLUMNS = 100, 200  # cells in cos θ and φ; even, so that none straddles the horizon

gauss_legendre = cache(np.polynomial.legendre.leggauss)


def cell_integrals(bsdf: mi.BSDF, wi: mi.Vector3f, cells: np.ndarray, order: int) -> np.ndarray:
    """Integrate the pdf over ``cells`` with the Gauss-Legendre rule of ``order`` nodes a side."""
    nodes, weights = (mi.Float(a.astype(np.float32)) for a in gauss_legendre(order))
    index = dr.arange(mi.UInt32, len(cells) * order**2)
    cell = dr.gather(mi.UInt32, mi.UInt32(cells.astype(np.uint32)), index // order**2)
    i, j = index % order, (index // order) % order
    phi = -dr.pi + 2 * dr.pi / COLUMNS * (cell % COLUMNS + 0.5 + 0.5 * dr.gather(mi.Float, nodes, i))
    z = 1 - 2 / ROWS * (cell // COLUMNS + 0.5 + 0.5 * dr.gather(mi.Float, nodes, j))
    r = dr.safe_sqrt(1 - z * z)
    density = evaluate.pdf(bsdf, wi, mi.Vector3f(r * dr.cos(phi), r * dr.sin(phi), z))
    area = 4 * dr.pi / (ROWS * COLUMNS) / 4  # of a cell, over that of the rule's square [-1, 1]²
    integrand = density * area * dr.gather(mi.Float, weights, i) * dr.gather(mi.Float, weights, j)
    return np.array(dr.block_sum(integrand, order**2), dtype=np.float64)


def expected_counts(bsdf: mi.BSDF, wi: mi.Vector3f, observed: np.ndarray, count: int) -> np.ndarray:
    """Integrate the pdf over every cell, times ``count``; finer where the rule's error could be taken for a deviation.

    That is where the last refinement mattered beside the noise of the count, and where the count disagrees: a lobe
    much narrower than a cell may slip between the nodes.
    """
    cells = np.arange(ROWS * COLUMNS)
    expected = count * cell_integrals(bsdf, wi, cells, 3)
    for order in (6, 12, 24, 48, 96):
        finer = count * cell_integrals(bsdf, wi, cells, order)
        noise = np.sqrt(np.maximum(finer, 1))
        doubt = np.maximum(
            np.abs(finer - expected[cells]) / (0.05 * noise), np.abs(finer - observed[cells]) / (4 * noise)
        )
        expected[cells] = finer
        affordable = 4_000_000 // (2 * order) ** 2
        cells = cells[np.argsort(-doubt)[: min(int((doubt > 1).sum()), affordable)]]
        if not len(cells):
            break
    return expected


def tabulate(bsdf: mi.BSDF, angles: tuple[float, float], count: int = PAIRS) -> Histogram:
    """Count sampled directions in cells, and integrate the pdf over them."""
    wi = evaluate.direction(*angles)
    samples = draw_samples(bsdf, wi, count, seed=4)
    x, y, z = evaluate.to_numpy(samples.drawn.wo, count)[:, samples.smooth]
    row = np.clip((1 - z) / 2 * ROWS, 0, ROWS - 1).astype(int)
    column = np.clip((np.arctan2(y, x) / np.pi + 1) / 2 * COLUMNS, 0, COLUMNS - 1).astype(int)
    observed = np.bincount(row * COLUMNS + column, minlength=ROWS * COLUMNS).astype(float)
    expected = expected_counts(bsdf, wi, observed, count)
    return Histogram(angles, observed.reshape(ROWS, COLUMNS), expected.reshape(ROWS, COLUMNS))


def p_value(histogram: Histogram, count: int = PAIRS) -> float:
    """Return Pearson's probability that samples of the pdf deviate from it as much as these.

    Samples that are lost (below the horizon, say) or from a delta lobe form one more cell: what the pdf leaves to 1.
    """
    observed = np.append(histogram.observed, count - histogram.observed.sum())
    expected = np.append(histogram.expected, max(count - histogram.expected.sum(), 0))
    order = np.argsort(expected)
    observed, expected = observed[order], expected[order]
    # Pool the rarest cells: the statistic follows the χ² distribution if five are expected in each.
    rare = int(np.searchsorted(expected, 5))
    pool = max(rare, int(np.searchsorted(np.cumsum(expected), 5)) + 1) if rare else 0
    if pool:
        observed = np.append(observed[:pool].sum(), observed[pool:])
        expected = np.append(expected[:pool].sum(), expected[pool:])
    statistic = float(((observed - expected) ** 2 / np.maximum(expected, 1e-30)).sum())
    return float(stats.chi2.sf(statistic, max(len(expected) - 1, 1)))


def chi_square(bsdf: mi.BSDF, significance: float = SIGNIFICANCE) -> Result:
    """Compare the histogram of sampled directions with the pdf over the whole sphere."""
    level = sidak(len(directions := incident(bsdf)), significance)
    worst, least = None, 2.0
    for angles in directions:
        histogram = tabulate(bsdf, angles)
        if histogram.observed.any() or histogram.expected.any():
            p = float(np.nan_to_num(p_value(histogram), nan=0.0))  # NaN in the pdf is no excuse
            worst, least = (histogram, p) if p < least else (worst, least)
    if worst is None:
        return Result("chi2", None, "has only delta lobes: there is no density to compare")
    measured = f"p = {least:.2g} at {named(worst.incident)}, the worst of {len(directions)} directions"
    kept_fraction, integral = worst.observed.sum() / PAIRS, worst.expected.sum() / PAIRS
    if abs(kept_fraction - integral) > 0.001:
        measured += f"; keeps {kept_fraction:.1%} of its samples, where the pdf integrates to {integral:.1%}"
    bound = f"p > {level:.2g}: a right sampler fails once in {1 / significance:.0f} (10⁶ samples, Šidák)"
    return Result("chi2", least > level, measured, bound, worst)


def pdf_integral(bsdf: mi.BSDF) -> Result:
    """Integrate the pdf over the sphere."""
    directions = incident(bsdf)
    observed = np.zeros(ROWS * COLUMNS)
    integrals = np.array([expected_counts(bsdf, evaluate.direction(*a), observed, 1_000_000).sum() for a in directions])
    integrals /= 1_000_000
    worst = int(np.argmax(np.where(np.isnan(integrals), np.inf, integrals)))
    return Result(
        "pdf-integral",
        bool(integrals[worst] <= 1.001),
        f"{integrals[worst]:.5f} at {named(directions[worst])}, the largest of {len(directions)} directions",
        "≤ 1.001: a density integrates to 1, or less if samples are lost; 0.001 for the quadrature",
        Curves([named(a) for a in directions], {"∫ pdf": integrals}, "integral of the pdf", 1.001),
    )
