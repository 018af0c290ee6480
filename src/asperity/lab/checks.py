"""What every BSDF must obey, and a test of each on any ``mi.BSDF``.

Each check returns a ``Result`` that says what was measured and what was allowed, and why. Bounds follow from float32
or from the statistics of the samples: seeds are fixed, so that a BSDF passes always or never.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from scipy import stats

from asperity.lab import evaluate

SIGNIFICANCE = 0.01
"""Probability that a statistical check rejects a right BSDF, over all its directions together (Šidák)."""

INCIDENT = ((12, 27), (45, 113), (75, 201), (85, 288))
"""Elevations from the normal and azimuths, in degrees. No azimuth is special to a lobe, a groove or a table."""

PAIRS = 1_000_000
SAMPLES = 200_000
GRADIENT_ERROR = 1e-2
LONGEST_STEP = 1e-2  # of finite differences, relative to the parameter
ROWS, COLUMNS = 100, 200  # cells in cos θ and φ; even, so that none straddles the horizon


@dataclass(frozen=True)
class Histogram:
    """Samples counted in cells of equal solid angle: rows from cos θ = 1 to -1, columns from φ = -π to π."""

    incident: tuple[float, float]
    observed: np.ndarray
    expected: np.ndarray


@dataclass(frozen=True)
class Violations:
    """Pairs of directions (n, 3), by how much they violate the bound (1 is just allowed), and what is violated."""

    wi: np.ndarray
    wo: np.ndarray
    excess: np.ndarray
    quantity: str


@dataclass(frozen=True)
class Curves:
    """Named curves over common labelled abscissae, and the largest value allowed, where there is one."""

    labels: Sequence[str]
    curves: dict[str, np.ndarray]
    quantity: str
    limit: float | None = None


@dataclass(frozen=True)
class Result:
    """Outcome of a check. ``passed`` is None if it was skipped, and ``measured`` says why."""

    name: str
    passed: bool | None
    measured: str
    bound: str = ""
    evidence: Histogram | Violations | Curves | None = None


def sidak(comparisons: int) -> float:
    """Return the significance of one comparison for which all together have ``SIGNIFICANCE``."""
    return float(1 - (1 - SIGNIFICANCE) ** (1 / comparisons))


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


# --- Sampling against its density -------------------------------------------------------------------------------------


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


def chi_square(bsdf: mi.BSDF) -> Result:
    """Compare the histogram of sampled directions with the pdf over the whole sphere."""
    level = sidak(len(directions := incident(bsdf)))
    worst, least = None, 2.0
    for angles in directions:
        histogram = tabulate(bsdf, angles)
        if histogram.observed.any() or histogram.expected.any():
            p = float(np.nan_to_num(p_value(histogram), nan=0.0))  # NaN in the pdf is no excuse
            worst, least = (histogram, p) if p < least else (worst, least)
    if worst is None:
        return Result("chi²", None, "has only delta lobes: there is no density to compare")
    measured = f"p = {least:.2g} at {named(worst.incident)}, the worst of {len(directions)} directions"
    kept_fraction, integral = worst.observed.sum() / PAIRS, worst.expected.sum() / PAIRS
    if abs(kept_fraction - integral) > 0.001:
        measured += f"; keeps {kept_fraction:.1%} of its samples, where the pdf integrates to {integral:.1%}"
    bound = f"p > {level:.2g}: a right sampler fails once in {1 / SIGNIFICANCE:.0f} (10⁶ samples, Šidák)"
    return Result("chi²", least > level, measured, bound, worst)


def pdf_integral(bsdf: mi.BSDF) -> Result:
    """Integrate the pdf over the sphere."""
    directions = incident(bsdf)
    observed = np.zeros(ROWS * COLUMNS)
    integrals = np.array([expected_counts(bsdf, evaluate.direction(*a), observed, 1_000_000).sum() for a in directions])
    integrals /= 1_000_000
    worst = int(np.argmax(np.where(np.isnan(integrals), np.inf, integrals)))
    return Result(
        "pdf integral",
        bool(integrals[worst] <= 1.001),
        f"{integrals[worst]:.5f} at {named(directions[worst])}, the largest of {len(directions)} directions",
        "≤ 1.001: a density integrates to 1, or less if samples are lost; 0.001 for the quadrature",
        Curves([named(a) for a in directions], {"∫ pdf": integrals}, "integral of the pdf", 1.001),
    )


def named(angles: tuple[float, float]) -> str:
    """Return the text of a direction."""
    return f"θ {angles[0]:g}°, φ {angles[1]:g}°"


# --- Two ways to the same number --------------------------------------------------------------------------------------


def agreement(
    name: str,
    wi: np.ndarray,
    wo: np.ndarray,
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
    return Result(
        name,
        beyond <= outliers,
        f"{beyond:.2%} of {excess.size} beyond tolerance; 99.9% agree to {relative * np.quantile(excess, 0.999):.1g}",
        f"{relative:g} relative + {absolute:g}" + (f" for all but {outliers:.2%}" if outliers else "") + f": {why}",
        Violations(wi[:, excess > 1].T, wo[:, excess > 1].T, excess[excess > 1], name),
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
    return agreement("weight", wi, wo, (samples.weight[:, samples.smooth], ratio), (1e-3, 1e-5), 1e-3, why)


def sampled_pdf(bsdf: mi.BSDF) -> Result:
    """Compare the pdf that ``sample`` returns with ``pdf`` of the direction."""
    if (found := smooth_samples(bsdf)) is None:
        return Result("sampled pdf", None, "samples only delta lobes")
    samples, wi, wo = found
    density = evaluate.to_numpy(evaluate.pdf(bsdf, samples.wi, samples.drawn.wo), SAMPLES)[:, samples.smooth]
    returned = evaluate.to_numpy(samples.drawn.pdf, SAMPLES)[:, samples.smooth]
    why = "both are the density of the same direction, up to rounding errors, which narrow lobes amplify"
    return agreement("sampled pdf", wi, wo, (returned, density), (1e-3, 1e-5), 1e-3, why)


def eval_pdf(bsdf: mi.BSDF) -> Result:
    """Compare ``eval_pdf`` with ``eval`` and ``pdf``."""
    wi, wo = random_incident(bsdf, SAMPLES, 7), evaluate.uniform_sphere(SAMPLES, 8)
    value, density = evaluate.eval_pdf(bsdf, wi, wo)
    both = np.concatenate([evaluate.to_numpy(x, SAMPLES) for x in (value, density)])
    apart = (evaluate.eval(bsdf, wi, wo), evaluate.pdf(bsdf, wi, wo))
    single = np.concatenate([evaluate.to_numpy(x, SAMPLES) for x in apart])
    why = "the same formulas, compiled apart: fused multiply-adds may round differently"
    i, o = (evaluate.to_numpy(w, SAMPLES) for w in (wi, wo))
    return agreement("eval_pdf", i, o, (both, single), (1e-4, 1e-6), 1e-4, why)


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
    """Compare f(wi, wo) with f(wo, wi) on random pairs.

    ``eval`` holds one cosine: multiplying by the other spares a division. Refraction squeezes radiance by η², but
    leaves importance alone: f(wi, wo) of radiance equals f(wo, wi) of importance. That is reciprocity where nothing
    refracts, and needs no knowledge of η where something does.
    """
    refracts = mi.has_flag(bsdf.flags(), mi.BSDFFlags.NonSymmetric)
    wi, wo = (random_incident(bsdf, PAIRS, seed) for seed in (12, 13))
    adjoint = mi.BSDFContext()
    adjoint.mode = mi.TransportMode.Importance
    forth = evaluate.eval(bsdf, wi, wo) * dr.abs(wi.z)
    back = mi.unpolarized_spectrum(bsdf.eval(adjoint, evaluate.interaction(wo), wi)) * dr.abs(wo.z)
    pair = (evaluate.to_numpy(forth, PAIRS), evaluate.to_numpy(back, PAIRS))
    if not (pair[0].any() or pair[1].any()):
        return Result("reciprocity", None, "has only delta lobes")
    why = "Helmholtz, float32" + ("; refracted pairs: radiance against importance, for the η²" if refracts else "")
    i, o = (evaluate.to_numpy(w, PAIRS) for w in (wi, wo))
    return agreement("reciprocity", i, o, pair, (1e-3, 1e-5), 1e-5, why)


# --- Hard directions --------------------------------------------------------------------------------------------------


def violations(wi: mi.Vector3f, wo: mi.Vector3f, bad: np.ndarray, quantity: str) -> Violations:
    """Return the pairs that ``bad`` selects."""
    i, o = (evaluate.to_numpy(w, bad.size)[:, bad].T for w in (wi, wo))
    return Violations(i, o, np.full(int(bad.sum()), np.inf), quantity)


def improper(lanes: int, *values: Any) -> np.ndarray:
    """Tell in which lanes a value is negative or not finite."""
    rows = np.concatenate([evaluate.to_numpy(x, lanes) for x in values])
    return ~(np.isfinite(rows) & (rows >= 0)).all(axis=0)


def finiteness(bsdf: mi.BSDF) -> Result:
    """Evaluate and sample at hard directions and with extreme random numbers."""
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
    return Result(
        "finiteness",
        not any(v.excess.size for v in found.values()),
        "; ".join(f"{name}: {v.excess.size} bad" for name, v in found.items()) + f" of {lanes} pairs, {k.size} samples",
        "0: finite and ≥ 0 at grazing and horizontal directions, wi = wo, mirror, normal, and nearby",
        max(found.values(), key=lambda v: v.excess.size),
    )


# --- Energy -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Estimate:
    """Means and standard errors, a channel each."""

    mean: np.ndarray
    error: np.ndarray

    @staticmethod
    def of(values: np.ndarray) -> Estimate:
        """Estimate the mean of values (channels, n)."""
        return Estimate(values.mean(axis=1), values.std(axis=1) / np.sqrt(values.shape[1]))


def energy(bsdf: mi.BSDF) -> Result:
    """Estimate the albedo: no direction may reflect and transmit more than it receives."""
    directions = [*incident(bsdf), (89.0, 160.0)]
    estimates = []
    for angles in directions:
        samples = draw_samples(bsdf, evaluate.direction(*angles), SAMPLES, seed=14)
        z = evaluate.direction(*angles).z * samples.drawn.wo.z
        # Radiance grows by 1/η² as it leaves a dense medium; its energy does not.
        squeezed = evaluate.to_numpy(dr.select(z < 0, dr.square(samples.drawn.eta), 1), SAMPLES)
        estimates.append(Estimate.of(samples.weight * squeezed))
    mean, error = (np.array([getattr(e, name) for e in estimates]) for name in ("mean", "error"))
    z_score = float(stats.norm.isf(sidak(mean.size)))
    margin = (1 + 1e-5 + z_score * error - mean).min(axis=1)
    worst = int(np.argmin(margin))
    return Result(
        "energy",
        bool(margin[worst] >= 0),
        f"albedo {mean[worst].max():.4f} ± {error[worst].max():.1g} at {named(directions[worst])}, "
        f"the worst of {len(directions)} directions",
        f"≤ 1 + {z_score:.1f} standard errors (significance {SIGNIFICANCE}, Šidák) + 1e-5 for float32",
        Curves([named(a) for a in directions], {"albedo": mean.max(axis=1)}, "albedo, largest channel", 1.0),
    )


def ratios(bsdf: mi.BSDF, wi: mi.Vector3f, wo: mi.Vector3f, used: np.ndarray, uniform: float) -> np.ndarray:
    """Return eval over the density of a mixture of the BSDF's samples and a fraction ``uniform`` of the sphere's."""
    density = evaluate.pdf(bsdf, wi, wo) * (1 - uniform) + uniform * dr.inv_four_pi
    values = evaluate.to_numpy(evaluate.eval(bsdf, wi, wo) / density, used.size)
    return np.where(used & (evaluate.to_numpy(density, used.size) > 0), values, 0)


def albedos(bsdf: mi.BSDF, angles: tuple[float, float], n: int = 2 * SAMPLES) -> dict[str, Estimate]:
    """Estimate the albedo, without delta lobes, in three independent ways.

    The third way would draw directions uniformly; but then narrow lobes are missed, and the standard error with them.
    So half of its samples are the BSDF's own, over the density of the mixture: it has bounded variance, and still sees
    what the BSDF never samples.
    """
    wi = evaluate.direction(*angles)
    first, second, third = (draw_samples(bsdf, wi, n, seed) for seed in (15, 16, 17))
    everywhere = ratios(bsdf, wi, evaluate.uniform_sphere(n, 18), np.ones(n, dtype=bool), 0.5)
    own = ratios(bsdf, wi, third.drawn.wo, third.smooth, 0.5)
    return {
        "sampled weights": Estimate.of(np.where(first.smooth, first.weight, 0)),
        "eval / pdf": Estimate.of(ratios(bsdf, wi, second.drawn.wo, second.smooth, 0)),
        "eval at uniform directions": Estimate.of((own + everywhere) / 2),
    }


def furnace(bsdf: mi.BSDF) -> Result:
    """Compare three estimates of the albedo: sampled weights, eval / pdf, eval at uniform directions."""
    directions = incident(bsdf)
    rows = [albedos(bsdf, angles) for angles in directions]
    names = list(rows[0])
    mean, error = (np.array([[getattr(row[k], f) for k in names] for row in rows]) for f in ("mean", "error"))
    pairs = ((0, 1), (1, 2), (0, 2))
    z_score = float(stats.norm.isf(sidak(len(pairs) * mean[:, 0].size) / 2))
    gap = np.array([np.abs(mean[:, a] - mean[:, b]) for a, b in pairs])
    noise = np.array([z_score * np.hypot(error[:, a], error[:, b]) + 1e-4 * mean[:, a] for a, b in pairs]) + 1e-6
    pair, row, channel = np.unravel_index(np.argmax(np.nan_to_num(gap / noise, nan=np.inf)), gap.shape)
    a, b = pairs[pair]
    return Result(
        "furnace",
        bool(gap[pair, row, channel] <= noise[pair, row, channel]),
        f"{names[a]} {mean[row, a, channel]:.4f}, {names[b]} {mean[row, b, channel]:.4f} at {named(directions[row])}",
        f"differ by ≤ {noise[pair, row, channel]:.1g}: {z_score:.1f} standard errors (Šidák) + 1e-4 for float32",
        Curves([named(d) for d in directions], {k: mean[:, i].max(-1) for i, k in enumerate(names)}, "albedo"),
    )


# --- Gradients --------------------------------------------------------------------------------------------------------


def differentiable(params: mi.SceneParameters) -> list[str]:
    """Return the names of the continuous parameters: numbers, colours and texels, but not transforms or wavelengths."""
    kinds = (mi.Float, mi.Color1f, mi.Color3f, mi.UnpolarizedSpectrum, mi.TensorXf)
    fixed = int(mi.ParamFlags.NonDifferentiable)
    return [
        key
        for key in params.keys()  # noqa: SIM118  (SceneParameters iterates over pairs)
        if isinstance(params[key], kinds) and not params.flags(key) & fixed and not key.endswith("wavelengths")
    ]


def perturbation(value: Any) -> tuple[Any, Any]:
    """Return where to differentiate a parameter, and the magnitude of its elements, in which steps are counted.

    0 and 1 often end a range: such elements are moved off, so that both neighbours are inside it.
    """
    numbers = np.array(value, dtype=np.float32)
    size = np.where(numbers == 0, np.abs(numbers).mean() or 1, np.abs(numbers)).astype(np.float32)
    inside = np.where(numbers == 0, 2 * LONGEST_STEP * size, np.where(numbers == 1, 1 - 2 * LONGEST_STEP, numbers))
    return type(value)(inside.astype(np.float32)), type(value)(size)


@contextmanager
def restored(params: mi.SceneParameters, keys: Sequence[str]) -> Iterator[None]:
    """Give the parameters back as they were."""
    before = {key: type(params[key])(params[key]) for key in keys}
    try:
        yield
    finally:
        for key, value in before.items():
            params[key] = value
        params.update()


def shifted_eval(
    bsdf: mi.BSDF,
    params: mi.SceneParameters,
    values: dict[str, tuple[Any, Any]],
    pair: tuple[mi.Vector3f, mi.Vector3f],
    shift: Any,
) -> mi.Float:
    """Evaluate, summed over channels, with all ``values`` shifted by ``shift`` times their magnitudes."""
    for key, (value, size) in values.items():
        params[key] = value + shift * size
    params.update()
    return dr.sum(evaluate.eval(bsdf, *pair)) + dr.zeros(mi.Float, dr.width(pair[1].x))


def derivative(evaluate_at: Callable[[Any], mi.Float]) -> tuple[np.ndarray, bool]:
    """Differentiate at 0, forward, lane by lane; also tell if the backward derivative is finite."""
    shift = dr.opaque(mi.Float, 0)
    dr.enable_grad(shift)
    dr.set_grad(shift, 1)
    value = evaluate_at(shift)
    if not dr.grad_enabled(value):
        return np.zeros(dr.width(value)), True
    forward = np.array(dr.forward_to(value), dtype=np.float64)
    shift = dr.opaque(mi.Float, 0)
    dr.enable_grad(shift)
    dr.backward(dr.sum(evaluate_at(shift)))
    return np.broadcast_to(forward, dr.width(value)), bool(np.isfinite(np.array(dr.grad(shift))).all())


def finite_difference(evaluate_at: Callable[[Any], mi.Float], h: float) -> tuple[np.ndarray, np.ndarray]:
    """Differentiate at 0 by central differences of steps h and h/2, extrapolated (Richardson): the error is O(h⁴).

    Also return by how much the two steps disagree.
    """

    def central(step: float) -> np.ndarray:
        up, down = (np.array(evaluate_at(dr.opaque(mi.Float, s)), dtype=np.float64) for s in (step, -step))
        return np.asarray((up - down) / (2 * step))

    coarse, fine = central(h), central(h / 2)
    return (4 * fine - coarse) / 3, np.abs(fine - coarse)


def difference_error(evaluate_at: Callable[[Any], mi.Float], automatic: np.ndarray, weight: np.ndarray) -> float:
    """Return the mean relative error of ``automatic`` against finite differences.

    Rounding errors grow with 1/h, truncation errors with h⁴ over the fourth power of the lobe's width, which is not
    known: a right derivative agrees with the differences of one of the steps, a wrong one with none. Lanes whose
    differences depend on the step straddle a jump or a kink, and are left out, unless they are most of all.
    """
    value = np.abs(np.array(evaluate_at(0.0), dtype=np.float64))
    errors = []
    for h in (LONGEST_STEP, LONGEST_STEP / 3, LONGEST_STEP / 10):
        numeric, spread = finite_difference(evaluate_at, h)
        noise = 16 * np.finfo(np.float32).eps / h * value
        smooth = spread <= 0.1 * np.abs(numeric) + noise
        w = np.where(smooth, weight, 0)
        allowed = (w * (np.abs(numeric) + noise / GRADIENT_ERROR)).sum()
        error = (w * np.abs(automatic - numeric)).sum() / max(allowed, 1e-30)
        errors.append(error if smooth[value > 0].mean() > 0.5 else np.inf)
    return float(np.min(errors))


def weighted_pairs(bsdf: mi.BSDF, n: int) -> tuple[mi.Vector3f, mi.Vector3f, np.ndarray]:
    """Return pairs of directions and their weights.

    Half of wo are the BSDF's own samples, and weights fall with their density, so that a narrow lobe counts as much as
    it reflects.
    """
    wi = random_incident(bsdf, n, 18)
    own = draw_samples(bsdf, wi, n, seed=19)
    use_own = mi.Bool(own.smooth) & (dr.arange(mi.UInt32, n) % 2 == 0)
    wo = dr.select(use_own, own.drawn.wo, evaluate.uniform_sphere(n, 20))
    dr.eval(wi, wo)
    return wi, wo, 1 / (evaluate.to_numpy(evaluate.pdf(bsdf, wi, wo), n)[0] + 1 / (4 * np.pi))


def gradients(bsdf: mi.BSDF) -> Result:
    """Compare automatic with finite differences, a parameter at a time, and look for NaN at hard directions.

    Directions are compared one by one: the sum over a lobe barely depends on its width.
    """
    params = mi.traverse(bsdf)
    keys = differentiable(params)
    if not keys or not dr.is_diff_v(mi.Float):
        return Result("gradients", None, "has no differentiable parameter")
    wi, wo, weight = weighted_pairs(bsdf, 10_000)
    if not evaluate.to_numpy(evaluate.eval(bsdf, wi, wo), weight.size).any():
        return Result("gradients", None, "has only delta lobes: eval is 0")
    errors, finite = {}, True
    for key in keys:
        with restored(params, [key]):
            at = partial(shifted_eval, bsdf, params, {key: perturbation(params[key])}, (wi, wo))
            automatic, backward = derivative(at)
            finite &= backward and bool(np.isfinite(automatic).all())
            errors[key] = difference_error(at, automatic, weight)
    hard = evaluate.hard_pairs()
    with restored(params, keys):
        every = {key: (params[key], 1.0) for key in keys}
        automatic, backward = derivative(partial(shifted_eval, bsdf, params, every, hard))
    bad = ~np.isfinite(automatic)
    worst = max(errors, key=lambda key: np.nan_to_num(errors[key], nan=np.inf))
    trouble = "" if finite and backward else "; backward derivatives are not finite"
    found = Curves(list(errors), {"automatic": np.array(list(errors.values()))}, "mean relative error", GRADIENT_ERROR)
    return Result(
        "gradients",
        bool(errors[worst] < GRADIENT_ERROR and finite and backward and not bad.any()),
        f"{errors[worst]:.2g} mean relative error for {worst}, the worst of {len(keys)} parameters; "
        f"{bad.sum()} not finite at hard directions{trouble}",
        f"< {GRADIENT_ERROR} against extrapolated central differences, which float32 leaves good to about 0.001",
        violations(*hard, bad, "gradient") if bad.any() else found,
    )


# --- Variants ---------------------------------------------------------------------------------------------------------


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
    before, values, troubles = evaluate.active_variant(), {}, []
    for variant in usable:
        try:
            mi.set_variant(variant)
            values[variant], finite = probe(description)
            if not finite:
                troubles.append(f"{variant}: not finite")
        except Exception as error:  # whatever a plugin raises is its trouble, and is reported
            troubles.append(f"{variant}: {complaint(error)}")
        finally:
            mi.set_variant(before)
    rgb = [v for v in values if "rgb" in v]
    deviation = max((float(np.abs(values[v] - values[rgb[0]]).max() / scale(values[rgb[0]])) for v in rgb), default=0.0)
    measured = "; ".join(troubles) or f"{len(values)} variants agree to {deviation:.1g}"
    return Result(
        "variants",
        not troubles and deviation < 1e-4,
        measured + (f" ({len(absent)} need a GPU: skipped)" if absent else ""),
        f"loads, finite; {' = '.join(rgb)} to 1e-4 of the largest value: same formulas, other rounding",
    )


def complaint(error: Exception) -> str:
    """Return the kind of an exception and its first line: Dr.Jit's go on with every overload of a function."""
    return f"{type(error).__name__}: {str(error).partition(chr(10))[0]}"


def scale(values: np.ndarray) -> float:
    """Return the largest magnitude, or 1 if all are zero."""
    return float(np.abs(values).max()) or 1.0


# --- All together -----------------------------------------------------------------------------------------------------

CHECKS: dict[str, Callable[[mi.BSDF], Result]] = {
    "chi²": chi_square,
    "pdf integral": pdf_integral,
    "weight": weights,
    "sampled pdf": sampled_pdf,
    "eval_pdf": eval_pdf,
    "determinism": determinism,
    "reciprocity": reciprocity,
    "finiteness": finiteness,
    "energy": energy,
    "furnace": furnace,
    "gradients": gradients,
}
"""The checks that take a BSDF; ``variants`` takes its description."""

NAMES = (*CHECKS, "variants")


def quiet(name: str, done: int, total: int) -> None:
    """Show no progress."""


def array_variant(description: dict[str, Any] | mi.BSDF) -> str:
    """Return the variant to check in: the active one, or if that is scalar, the one that vectorises it."""
    active = evaluate.active_variant()
    if active.startswith("scalar_") and not isinstance(description, dict):
        raise ValueError(
            f"{active} evaluates one direction at a time: pass the BSDF's dictionary, or use an llvm variant"
        )
    return active.replace("scalar_", "llvm_ad_")


def check(
    description: dict[str, Any] | mi.BSDF,
    progress: Callable[[str, int, int], None] = quiet,
    only: Sequence[str] = NAMES,
) -> list[Result]:
    """Run the checks named in ``only`` on a BSDF, or on the dictionary of one.

    ``progress(name, done, total)`` is called before each check. Dictionaries must hold no Mitsuba objects: they are
    loaded in other variants too. In a scalar variant the checks run in its LLVM counterpart.
    """
    if unknown := [name for name in only if name not in NAMES]:
        raise ValueError(f"no check is called {unknown[0]!r}: choose from {', '.join(NAMES)}")
    active, vectorised = evaluate.active_variant(), array_variant(description)
    results = []
    try:
        mi.set_variant(vectorised)
        bsdf = evaluate.load(description)
        for done, name in enumerate(only):
            progress(name, done, len(only))
            results.append(attempt(name, bsdf, description))
    finally:
        mi.set_variant(active)
    if vectorised != active:
        results.append(Result("scalar", None, f"{active} evaluates one direction at a time: checked in {vectorised}"))
    return results


def attempt(name: str, bsdf: mi.BSDF, description: dict[str, Any] | mi.BSDF) -> Result:
    """Run one check; a BSDF that raises an exception fails it."""
    try:
        return variants(description) if name == "variants" else CHECKS[name](bsdf)
    except Exception as error:  # whatever a plugin raises is its failure, and is reported
        return Result(name, False, complaint(error), "raises no exception")
