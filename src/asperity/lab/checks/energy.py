"""Albedos: none above 1, and the same however they are estimated."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from scipy import stats

from asperity.lab import evaluate

from .results import SIGNIFICANCE, Curves, Result, named, sidak
from .samples import SAMPLES, draw_samples, incident


@dataclass(frozen=True)
class Albedo:
    """Means and standard errors, a channel each."""

    mean: np.ndarray
    error: np.ndarray

    @staticmethod
    def of(values: np.ndarray) -> Albedo:
        """Estimate the mean of values (channels, n)."""
        return Albedo(values.mean(axis=1), values.std(axis=1) / np.sqrt(values.shape[1]))


def energy(bsdf: mi.BSDF, significance: float = SIGNIFICANCE) -> Result:
    """Estimate the albedo: no direction may reflect and transmit more than it receives."""
    directions = [*incident(bsdf), (89.0, 160.0)]
    estimates = []
    for angles in directions:
        samples = draw_samples(bsdf, evaluate.direction(*angles), SAMPLES, seed=14)
        z = evaluate.direction(*angles).z * samples.drawn.wo.z
        # Radiance grows by 1/η² as it leaves a dense medium; its energy does not.
        squeezed = evaluate.to_numpy(dr.select(z < 0, dr.square(samples.drawn.eta), 1), SAMPLES)
        estimates.append(Albedo.of(samples.weight * squeezed))
    mean, error = (np.array([getattr(e, name) for e in estimates]) for name in ("mean", "error"))
    z_score = float(stats.norm.isf(sidak(mean.size, significance)))
    margin = (1 + 1e-5 + z_score * error - mean).min(axis=1)
    worst = int(np.argmin(margin))
    return Result(
        "energy",
        bool(margin[worst] >= 0),
        f"albedo {mean[worst].max():.4f} ± {error[worst].max():.1g} at {named(directions[worst])}, "
        f"the worst of {len(directions)} directions",
        f"≤ 1 + {z_score:.1f} standard errors (significance {significance:.2g}, Šidák) + 1e-5 for float32",
        Curves([named(a) for a in directions], {"albedo": mean.max(axis=1)}, "albedo, largest channel", 1.0),
    )


def ratios(bsdf: mi.BSDF, wi: mi.Vector3f, wo: mi.Vector3f, used: np.ndarray, uniform: float) -> np.ndarray:
    """Return eval over the density of a mixture of the BSDF's samples and a fraction ``uniform`` of the sphere's."""
    density = evaluate.pdf(bsdf, wi, wo) * (1 - uniform) + uniform * dr.inv_four_pi
    values = evaluate.to_numpy(evaluate.eval(bsdf, wi, wo) / density, used.size)
    return np.where(used & (evaluate.to_numpy(density, used.size) > 0), values, 0)


def albedos(bsdf: mi.BSDF, angles: tuple[float, float], n: int = 2 * SAMPLES) -> dict[str, Albedo]:
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
        "sampled weights": Albedo.of(np.where(first.smooth, first.weight, 0)),
        "eval / pdf": Albedo.of(ratios(bsdf, wi, second.drawn.wo, second.smooth, 0)),
        "eval at uniform directions": Albedo.of((own + everywhere) / 2),
    }


def furnace(bsdf: mi.BSDF, significance: float = SIGNIFICANCE) -> Result:
    """Compare three estimates of the albedo: sampled weights, eval / pdf, eval at uniform directions."""
    directions = incident(bsdf)
    rows = [albedos(bsdf, angles) for angles in directions]
    names = list(rows[0])
    mean, error = (np.array([[getattr(row[k], f) for k in names] for row in rows]) for f in ("mean", "error"))
    pairs = ((0, 1), (1, 2), (0, 2))
    z_score = float(stats.norm.isf(sidak(len(pairs) * mean[:, 0].size, significance) / 2))
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
